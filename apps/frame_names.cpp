#include "apps/frame_names.h"

#include <algorithm>
#include <regex>

#include <fmt/format.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

constexpr int kMostFrames = 1'000'000;

/// Appends the frames of "1-48", "1-48x4" or "7"; false for anything else.
bool append_range(const std::string& text, std::vector<int>& frames) {
  static const std::regex form(R"((\d{1,9})(?:-(\d{1,9}))?(?:x(\d{1,9}))?)");
  std::smatch match;
  if (!std::regex_match(text, match, form)) return false;
  const int first = std::stoi(match[1]);
  const int last = match[2].matched ? std::stoi(match[2]) : first;
  const int step = match[3].matched ? std::stoi(match[3]) : 1;
  if (last < first || step < 1 || (last - first) / step >= kMostFrames - int(frames.size())) return false;
  for (int frame = first; frame <= last; frame += step) frames.push_back(frame);
  return true;
}

void refuse_repeated(const std::string& text, std::vector<int> frames) {
  std::sort(frames.begin(), frames.end());
  const auto repeated = std::adjacent_find(frames.begin(), frames.end());
  if (repeated == frames.end()) return;
  throw Error(ErrorKind::usage, SourceLoc{},
              fmt::format("--frames {} names frame {} twice", text, *repeated));
}

}  // namespace

std::vector<int> parse_frames(const std::string& text) {
  std::vector<int> frames;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    if (!append_range(text.substr(begin, end - begin), frames)) {
      throw Error(ErrorKind::usage, SourceLoc{},
                  fmt::format("--frames {}; expected FIRST-LAST, such as 1-48, 1-48x4 for every fourth, or a "
                              "list of such, 1,4,10-20",
                              text));
    }
    begin = end + 1;
  }
  refuse_repeated(text, frames);
  return frames;
}

bool has_frame_number(const std::filesystem::path& name) {
  return name.string().find('%') != std::string::npos;
}

std::filesystem::path frame_name(const std::filesystem::path& name, int frame) {
  static const std::regex place("%(?:0([1-9]))?d");
  const std::string text = name.string();
  std::smatch match;
  if (!has_frame_number(name)) return name;
  const bool has_place = std::regex_search(text, match, place);
  const std::string before = match.prefix(), after = match.suffix();
  if (!has_place || before.find('%') != std::string::npos || after.find('%') != std::string::npos) {
    throw Error(ErrorKind::usage, text, "expected one place for the frame's number, such as smoke.%04d.vdb");
  }
  const int width = match[1].matched ? std::stoi(match[1]) : 1;
  return fmt::format("{}{:0{}}{}", before, frame, width, after);
}

}  // namespace pileus
