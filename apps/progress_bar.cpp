#include "apps/progress_bar.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace pileus {
namespace {

constexpr int kWidth = 32;  ///< of the bar [characters]

std::string as_clock(double seconds) {
  const int whole = int(std::min(seconds, 359999.0) + 0.5);
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

ProgressBar::ProgressBar(std::string task, bool quiet)
    : m_task(std::move(task)), m_shown(!quiet && isatty(STDERR_FILENO)) {}

ProgressBar::~ProgressBar() {
  wipe();
}

void ProgressBar::wipe() {
  if (m_drawn) std::fputs("\r\033[K", stderr);
  m_drawn = false;
}

void ProgressBar::update(std::string task, double share) {
  m_task = std::move(task);
  update(share);
}

void ProgressBar::update(double share) {
  const Clock::time_point now = Clock::now();
  if (!m_shown || now - m_last_draw < std::chrono::milliseconds(100)) return;
  m_last_draw = now;
  m_drawn = true;
  const double elapsed = std::chrono::duration<double>(now - m_start).count();
  const std::string left = share > 0.0 ? as_clock(elapsed * (1.0 - share) / share) : "-:--";
  const int filled = int(share * kWidth);
  std::fputs(fmt::format("\r{} [{}{}] {:3.0f} %  {} left\033[K", m_task, std::string(size_t(filled), '#'),
                         std::string(size_t(kWidth - filled), '.'), 100.0 * share, left)
                 .c_str(),
             stderr);
}

}  // namespace pileus
