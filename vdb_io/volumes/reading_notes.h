#pragma once

#include <string>
#include <vector>

namespace pileus {

/// What a volume's reader chose or converted on the way, a sentence each: the user is to hear of it. A
/// LoadedDensity that has such notes is one of these, too.
class ReadingNotes {
 public:
  virtual ~ReadingNotes() = default;
  virtual std::vector<std::string> notes() const = 0;
};

}  // namespace pileus
