#include "apps/frame_names.h"

#include <regex>

#include <fmt/format.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

constexpr int kMostFrames = 1'000'000;

}  // namespace

std::vector<int> parse_frames(const std::string& text) {
  static const std::regex form(R"((\d{1,9})(?:-(\d{1,9}))?(?:x(\d{1,9}))?)");
  std::smatch match;
  const bool fits = std::regex_match(text, match, form);
  const int first = fits ? std::stoi(match[1]) : 0;
  const int last = fits && match[2].matched ? std::stoi(match[2]) : first;
  const int step = fits && match[3].matched ? std::stoi(match[3]) : 1;
  if (!fits || last < first || step < 1 || (last - first) / step >= kMostFrames) {
    throw Error(
        ErrorKind::usage, SourceLoc{},
        fmt::format("--frames {}; expected FIRST-LAST, such as 1-48, or 1-48x4 for every fourth", text));
  }
  std::vector<int> frames;
  for (int frame = first; frame <= last; frame += step) frames.push_back(frame);
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
