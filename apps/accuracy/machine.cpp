#include "apps/accuracy/machine.h"

#include <array>
#include <ctime>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <sys/utsname.h>

namespace pileus {
namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

std::string compiler() {
#if defined(__clang__)
  return "Clang " __clang_version__;
#else
  return "GCC " __VERSION__;
#endif
}

}  // namespace

std::string machine_line() {
  utsname system{};
  uname(&system);
#ifdef NDEBUG
  constexpr const char* kBuild = "optimised";
#else
  constexpr const char* kBuild = "with assertions";
#endif
  return fmt::format("{}, {} cores; {} {} {}; {}, {}", processor(), std::thread::hardware_concurrency(),
                     system.sysname, system.release, system.machine, compiler(), kBuild);
}

std::string date_line() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M", &local)};
}

}  // namespace pileus
