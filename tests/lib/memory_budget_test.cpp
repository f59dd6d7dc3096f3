#include "lib/core/memory_budget.h"

#include <gtest/gtest.h>

namespace pileus {
namespace {

TEST(MemoryBudget, sizes_as_people_write_them) {
  EXPECT_EQ(parse_bytes("2000000"), 2'000'000u);
  EXPECT_EQ(parse_bytes("512M"), 512'000'000u);
  EXPECT_EQ(parse_bytes("1.5g"), 1'500'000'000u);
  EXPECT_EQ(parse_bytes("2T"), 2'000'000'000'000u);
  for (const char* wrong :
       {"", "M", "0", "-1", "1MB", "1 M", "1e9", "0x10", "nan", "inf", "1.2.3", "99999999999T", "5KM"})
    EXPECT_FALSE(parse_bytes(wrong)) << wrong;
}

TEST(MemoryBudget, sizes_as_people_read_them) {
  EXPECT_EQ(bytes_text(999), "999 bytes");
  EXPECT_EQ(bytes_text(1000), "1 kB");
  EXPECT_EQ(bytes_text(98'967), "99 kB");
  EXPECT_EQ(bytes_text(999'900), "1 MB");
  EXPECT_EQ(bytes_text(2'511'715), "2.51 MB");
  EXPECT_EQ(bytes_text(12'000'000'000), "12 GB");
}

TEST(MemoryBudget, an_option_that_allows_as_much) {
  for (const uint64_t bytes :
       {uint64_t(1), uint64_t(50'000'001), uint64_t(9'999'999'999), uint64_t(123'456'789'012)}) {
    const auto allowed = parse_bytes(bytes_option(bytes));
    ASSERT_TRUE(allowed);
    EXPECT_GE(*allowed, bytes);
    EXPECT_LE(double(*allowed), 1.1 * double(bytes) + 1e6);
  }
}

TEST(MemoryBudget, a_share_of_the_machine_until_set) {
  const uint64_t share = memory_budget();
  EXPECT_GT(share, 100'000'000u);
  set_memory_budget(7);
  EXPECT_EQ(memory_budget(), 7u);
  set_memory_budget(0);
  EXPECT_EQ(memory_budget(), share);
}

}  // namespace
}  // namespace pileus
