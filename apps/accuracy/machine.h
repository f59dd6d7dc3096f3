#pragma once

#include <string>

namespace pileus {

/// What seconds were measured on: "AMD EPYC 7R13, 2 cores; Linux 6.1 x86_64; GCC 12.2.0, optimised".
std::string machine_line();

/// The local time now: "2026-11-22 03:05".
std::string date_line();

}  // namespace pileus
