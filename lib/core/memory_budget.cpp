#include "lib/core/memory_budget.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <exception>
#include <fstream>
#include <string_view>

#include <fmt/format.h>
#include <unistd.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

constexpr std::string_view kSuffixes = "KMGT";

uint64_t machine_memory() {
  uint64_t bytes = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
  uint64_t allowed = 0;
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> allowed) bytes = std::min(bytes, allowed);  // else: "max"
  return bytes;
}

std::atomic<uint64_t> g_budget{0};  // 0: not set

}  // namespace

uint64_t memory_budget() {
  static const uint64_t default_budget = machine_memory() / 2;
  const uint64_t budget = g_budget;
  return budget > 0 ? budget : default_budget;
}

void set_memory_budget(uint64_t bytes) {
  g_budget = bytes;
}

void require_memory(const std::string& file, const std::string& what, uint64_t bytes) {
  if (bytes <= memory_budget()) return;
  throw Error(ErrorKind::file, file,
              fmt::format("{} needs {} of memory, the budget is {}; allow more with --memory {}", what,
                          bytes_text(bytes), bytes_text(memory_budget()), bytes_option(bytes)));
}

std::optional<uint64_t> parse_bytes(const std::string& text) {
  size_t used = 0;
  double number = 0.0;
  if (text.empty() || text.find_first_not_of("0123456789.KMGTkmgt") != std::string::npos) return std::nullopt;
  try {
    number = std::stod(text, &used);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  if (used + 1 == text.size()) {
    const size_t power = kSuffixes.find(char(std::toupper(static_cast<unsigned char>(text.back()))));
    if (power == std::string_view::npos) return std::nullopt;
    number *= std::pow(1000.0, double(power + 1));
    ++used;
  }
  if (used != text.size() || !(number >= 1.0 && number < 1e18)) return std::nullopt;
  return uint64_t(number);
}

std::string bytes_option(uint64_t bytes) {
  constexpr uint64_t kMega = 1'000'000, kGiga = 1'000'000'000;
  if (bytes >= 10 * kGiga) return fmt::format("{}G", (bytes + kGiga - 1) / kGiga);
  return fmt::format("{}M", std::max<uint64_t>(1, (bytes + kMega - 1) / kMega));
}

std::string bytes_text(uint64_t bytes) {
  double number = double(bytes);
  if (number < 1000.0) return fmt::format("{} bytes", bytes);
  constexpr std::string_view kUnits = "kMGTPE";
  size_t unit = 0;
  for (number /= 1000.0; number >= 999.5 && unit + 1 < kUnits.size(); number /= 1000.0) ++unit;
  return fmt::format("{:.3g} {}B", number, kUnits[unit]);
}

}  // namespace pileus
