#include "tests/hard_cases/hard_cases.h"

#include <fstream>

namespace pileus::hard_cases {

const std::vector<HardCase>& all_cases() {
  static const std::vector<HardCase> cases = [] {
    std::ifstream file(PILEUS_SOURCE_DIR "/tests/hard_cases/hard_cases.json");
    const nlohmann::json catalogue = nlohmann::json::parse(file);
    std::vector<HardCase> result;
    for (const nlohmann::json& row : catalogue.at("cases")) {
      result.push_back({row.at("id"), row.at("group"), row});
    }
    return result;
  }();
  return cases;
}

}  // namespace pileus::hard_cases
