#pragma once

#include <chrono>
#include <string>

namespace pileus {

/// A progress bar with the time left, on stderr; silent where that is no terminal, or where told to be.
class ProgressBar {
 public:
  ProgressBar(std::string task, bool quiet);
  ~ProgressBar();  ///< wipes the bar
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `share` of the work done, 0 .. 1. Draws at most ten times a second.
  void update(double share);
  void update(std::string task, double share);  ///< the same, with another task from now on

  /// Makes room for a line of text; the next update draws the bar again.
  void wipe();

 private:
  using Clock = std::chrono::steady_clock;

  std::string m_task;
  bool m_shown;
  bool m_drawn = false;
  Clock::time_point m_start = Clock::now();
  Clock::time_point m_last_draw{};
};

}  // namespace pileus
