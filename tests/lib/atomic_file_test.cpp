#include "lib/core/atomic_file.h"

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(AtomicFile, appears_whole_and_alone_after_commit) {
  const TempFolder folder;
  {
    AtomicFile file(folder / "cloud.vdb");
    EXPECT_NE(file.path(), folder / "cloud.vdb");
    EXPECT_EQ(file.path().parent_path(), fs::canonical(folder.path()));
    EXPECT_EQ(file.path().extension(), ".vdb");
    std::ofstream(file.path()) << "grid";
    EXPECT_FALSE(fs::exists(folder / "cloud.vdb"));
    file.commit();
  }
  EXPECT_EQ(read_text(folder / "cloud.vdb"), "grid");
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(AtomicFile, leaves_the_old_file_and_no_temporary_when_an_exception_passes) {
  const TempFolder folder;
  std::ofstream(folder / "a.txt") << "old";
  const auto fail_half_way = [&] {
    AtomicFile file(folder / "a.txt");
    std::ofstream(file.path()) << "ne";
    throw std::runtime_error("interrupted");
  };
  EXPECT_THROW(fail_half_way(), std::runtime_error);
  EXPECT_EQ(read_text(folder / "a.txt"), "old");
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(AtomicFile, two_writers_of_one_target_do_not_meet) {
  const TempFolder folder;
  AtomicFile first(folder / "a.txt"), second(folder / "a.txt");
  EXPECT_NE(first.path(), second.path());
  std::ofstream(first.path()) << "first";
  std::ofstream(second.path()) << "second";
  first.commit();
  second.commit();
  EXPECT_EQ(read_text(folder / "a.txt"), "second");
}

TEST(AtomicFile, replaces_what_a_link_points_to) {
  const TempFolder folder;
  fs::create_directory(folder / "inner");
  std::ofstream(folder / "inner/real.txt") << "old";
  fs::create_symlink("inner/real.txt", folder / "link.txt");
  AtomicFile file(folder / "link.txt");
  std::ofstream(file.path()) << "new";
  file.commit();
  EXPECT_TRUE(fs::is_symlink(folder / "link.txt"));
  EXPECT_EQ(read_text(folder / "inner/real.txt"), "new");
}

TEST(AtomicFile, refuses_a_missing_folder_a_folder_and_a_device) {
  const TempFolder folder;
  for (const fs::path& target :
       {folder / "missing/a.exr", folder.path(), fs::path("/dev/null"), fs::path()}) {
    try {
      AtomicFile file(target);
      ADD_FAILURE() << target << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::file) << target;
      EXPECT_NE(std::string(error.what()).find(target.string()), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("expected"), std::string::npos) << error.what();
    }
  }
}

TEST(AtomicFile, a_vanished_temporary_is_an_error_of_the_file) {
  const TempFolder folder;
  AtomicFile file(folder / "a.txt");
  fs::remove(file.path());
  EXPECT_THROW(file.commit(), Error);
}

}  // namespace
}  // namespace pileus
