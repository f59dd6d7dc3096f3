// Files damaged in thousands of ways, after the model of OpenEXR's tests: a window of noise slides over the
// file, and bytes of the header change. Whatever comes of it is read in a child process with a limit of
// memory, and a clock runs for every file: no crash, no hang, no more than 1 GB. A sample of a few damages
// per file runs always; where PILEUS_LONG_TESTS is set, 5000 and 3000 do, of real files too.

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <random>

#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/time.h>

#include "lib/core/memory_budget.h"
#include "tests/fixtures/forked.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/fixtures/vdb_seeds.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/inspect.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

constexpr unsigned kSeed = 20;
constexpr int kSecondsPerFile = 2;  // of processor time
constexpr uint64_t kMemoryBytes = 1'000'000'000;
// What the test itself and its libraries take of the address space before any file is read: code, stacks and
// arenas of threads.
constexpr uint64_t kProgramBytes = 1'500'000'000;
constexpr size_t kHeaderBytes = 700, kBatch = 250;
constexpr int kSample = 8;

ptrdiff_t threads_of_process() {
  using Tasks = std::filesystem::directory_iterator;
  return std::distance(Tasks("/proc/self/task"), Tasks());
}

/// Some libraries start threads as they are loaded; those sleep, and do no harm.
const ptrdiff_t kThreadsAtStart = threads_of_process();

bool is_long_run() {
  return std::getenv("PILEUS_LONG_TESTS") != nullptr;
}

/// Errors are fine; anything else that is thrown ends the child.
template <class Read>
void allow_errors(const Read& read) {
  try {
    read();
  } catch (const Error&) {
  }
}

/// Reads as render, convert and info do.
void read(const std::filesystem::path& path) {
  const VdbReadOptions options{"", LevelSetPolicy::to_fog, BadValuePolicy::to_zero};
  allow_errors([&] { field_from_voxels(read_density_voxels(path, options).voxels, Affine()); });
  allow_errors([&] { field_from_grid(read_density_grid(path, options).grid, Affine()); });
  allow_errors([&] { inspect_vdb(path); });
}

using Damage = std::function<void(std::string& bytes, int round, std::mt19937& random)>;

/// A window of 1 to 64 bytes moves over the whole file in `rounds` steps; it fills with noise, zeros or ones.
void slide_window(std::string& bytes, int round, int rounds, std::mt19937& random) {
  const size_t window = std::min(bytes.size(), size_t(1) << (random() % 7));
  const size_t begin = (bytes.size() - window) * size_t(round) / size_t(std::max(1, rounds - 1));
  const unsigned kind = random() % 4;
  for (size_t i = begin; i < begin + window; ++i)
    bytes[i] = kind == 0 ? '\0' : kind == 1 ? '\xff' : char(random());
}

/// One to four bytes of the header, or one of its 32-bit numbers.
void change_header(std::string& bytes, std::mt19937& random) {
  const size_t header = std::min(bytes.size() - 4, kHeaderBytes);
  if (random() % 2 == 0) {
    const uint32_t extremes[] = {
        0, 1, 0x7fffffff, 0x80000000, 0xffffffff, uint32_t(bytes.size()), uint32_t(random())};
    std::memcpy(bytes.data() + random() % header, &extremes[random() % std::size(extremes)], 4);
    return;
  }
  for (unsigned n = 1 + random() % 4; n > 0; --n) bytes[random() % header] = char(random());
}

class Corruption : public testing::Test {
 protected:
  Corruption() {
    void* shared = mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    m_round = static_cast<int*>(shared);
  }
  void SetUp() override {
    if (threads_of_process() > kThreadsAtStart) {
      GTEST_SKIP() << "an earlier test has started threads, and such a process cannot be split; run it alone";
    }
  }
  ~Corruption() override { munmap(m_round, sizeof(int)); }

  /// The project's own files and, in a long run, real ones.
  std::vector<VdbSeed> seeds() const {
    std::vector<VdbSeed> seeds;
    // OpenVDB starts threads when it writes, and a process with threads cannot be split.
    EXPECT_EQ(run_forked(0, [&] { write_vdb_seeds(folder / "seeds"); }), 0);
    for (const auto& file : std::filesystem::directory_iterator(folder / "seeds"))
      seeds.push_back({file.path().stem().string(), file.path()});
    if (!is_long_run()) return seeds;
    for (const char* real :
         {"vdb/points.vdb", "vdb/torus01.vdb", "vdb/dragon.vdb", "vdb/houdini_sphere_density.vdb"}) {
      const std::filesystem::path path = std::filesystem::path(PILEUS_DATA_DIR) / real;
      if (std::filesystem::exists(path)) seeds.push_back({real, path});
    }
    return seeds;
  }

  /// Reads `rounds` damaged copies of each seed; in batches, so that one crash costs one child.
  void read_damaged(int rounds, const Damage& damage) {
    for (const VdbSeed& seed : seeds()) {
      const std::string sound = read_bytes(seed.path);
      if (is_long_run()) fmt::print("{}: {} damages of {} bytes\n", seed.name, rounds, sound.size());
      for (int begin = 0; begin < rounds; begin += int(kBatch)) {
        const int end = std::min(rounds, begin + int(kBatch));
        const int result =
            run_forked(kProgramBytes + kMemoryBytes, [&] { read_batch(sound, begin, end, damage); });
        EXPECT_EQ(result, 0) << (result == SIGPROF ? "took too long: " : "died: ") << seed.name << ", round "
                             << *m_round;
      }
    }
  }

  TempFolder folder;

 private:
  void read_batch(const std::string& sound, int begin, int end, const Damage& damage) {
    set_memory_budget(kMemoryBytes / 2);
    for (*m_round = begin; *m_round < end; ++*m_round) {
      std::mt19937 random(kSeed + unsigned(*m_round));
      std::string bytes = sound;
      damage(bytes, *m_round, random);
      write_bytes(folder / "damaged.vdb", bytes);
      const itimerval patience{{0, 0}, {kSecondsPerFile, 0}};
      setitimer(ITIMER_PROF, &patience, nullptr);  // SIGPROF ends the child
      read(folder / "damaged.vdb");
    }
  }

  int* m_round;  ///< shared with the children
};

TEST_F(Corruption, a_window_of_noise_slides_over_each_file) {
  const int rounds = is_long_run() ? 5000 : kSample;
  read_damaged(rounds, [=](std::string& bytes, int round, std::mt19937& random) {
    slide_window(bytes, round, rounds, random);
  });
}

TEST_F(Corruption, bytes_of_the_header_change) {
  read_damaged(is_long_run() ? 3000 : kSample,
               [](std::string& bytes, int, std::mt19937& random) { change_header(bytes, random); });
}

/// The harness itself: it sees a crash, a hang and a want of memory.
TEST_F(Corruption, the_harness_can_fail) {
  EXPECT_EQ(run_forked(0, [] { raise(SIGSEGV); }), SIGSEGV);
  EXPECT_EQ(run_forked(0, [] { throw std::runtime_error("lost"); }), -1);
  EXPECT_EQ(run_forked(0,
                       [] {
                         const itimerval patience{{0, 0}, {0, 1000}};
                         setitimer(ITIMER_PROF, &patience, nullptr);
                         for (std::atomic<int> n = 0;; ++n) {
                         }
                       }),
            SIGPROF);
#if !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__
  EXPECT_EQ(run_forked(kMemoryBytes, [] { std::string(kMemoryBytes, 'x').shrink_to_fit(); }), -1);
#endif
}

}  // namespace
}  // namespace pileus
