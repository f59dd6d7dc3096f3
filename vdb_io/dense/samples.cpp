#include "vdb_io/dense/samples.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>

#include <half.h>

#include "lib/core/error.h"
#include "vdb_io/file_cursor.h"

namespace pileus {
namespace {

struct TypeRow {
  SampleType type;
  const char* name;
  uint32_t bytes;
};
constexpr std::array<TypeRow, 9> kTypes{{{SampleType::uint8, "uint8", 1},
                                         {SampleType::int8, "int8", 1},
                                         {SampleType::uint16, "uint16", 2},
                                         {SampleType::int16, "int16", 2},
                                         {SampleType::uint32, "uint32", 4},
                                         {SampleType::int32, "int32", 4},
                                         {SampleType::float16, "float16", 2},
                                         {SampleType::float32, "float32", 4},
                                         {SampleType::float64, "float64", 8}}};

/// Calls visit with a value of the C++ type that stores `type`.
template <class Visit>
auto with_stored_type(SampleType type, const Visit& visit) {
  switch (type) {
    case SampleType::uint8:
      return visit(uint8_t{});
    case SampleType::int8:
      return visit(int8_t{});
    case SampleType::uint16:
      return visit(uint16_t{});
    case SampleType::int16:
      return visit(int16_t{});
    case SampleType::uint32:
      return visit(uint32_t{});
    case SampleType::int32:
      return visit(int32_t{});
    case SampleType::float16:
      return visit(half{});
    case SampleType::float64:
      return visit(double{});
    case SampleType::float32:
      break;
  }
  return visit(float{});
}

/// What holds every value of Stored.
template <class Stored>
using Holder = std::conditional_t<std::is_same_v<Stored, uint32_t> || std::is_same_v<Stored, int32_t> ||
                                      std::is_same_v<Stored, double>,
                                  double, float>;

template <class Stored>
std::vector<Holder<Stored>> read_all(FileCursor& file, bool big_endian, uint64_t count) {
  static_assert(std::endian::native == std::endian::little);
  constexpr uint64_t kChunk = 1 << 16;
  std::vector<Holder<Stored>> values(count);
  std::vector<char> bytes(std::min(count, kChunk) * sizeof(Stored));
  for (uint64_t begin = 0; begin < count; begin += kChunk) {
    const uint64_t n = std::min(kChunk, count - begin);
    file.read(bytes.data(), n * sizeof(Stored), "samples");
    for (uint64_t i = 0; i < n; ++i) {
      char* at = bytes.data() + i * sizeof(Stored);
      if (big_endian) std::reverse(at, at + sizeof(Stored));
      Stored stored;
      std::memcpy(static_cast<void*>(&stored), at, sizeof stored);
      values[begin + i] = Holder<Stored>(stored);
    }
  }
  return values;
}

}  // namespace

const char* name_of(SampleType type) {
  return kTypes[size_t(type)].name;
}

uint32_t bytes_of(SampleType type) {
  return kTypes[size_t(type)].bytes;
}

SampleType sample_type_named(const std::string& name) {
  std::vector<std::string> names;
  for (const TypeRow& row : kTypes) {
    if (name == row.name) return row.type;
    names.emplace_back(row.name);
  }
  throw Error(ErrorKind::usage, SourceLoc{},
              fmt::format("unknown type \"{}\"; expected {}", name, join_or(names)));
}

Samples read_samples(FileCursor& file, SampleType type, bool big_endian, uint64_t count) {
  if (count > file.remaining() / bytes_of(type)) {
    file.fail(fmt::format("is cut short: {} samples of {} bytes at byte {}, {} bytes are left", count,
                          bytes_of(type), file.position(), file.remaining()));
  }
  return with_stored_type(
      type, [&](auto stored) -> Samples { return read_all<decltype(stored)>(file, big_endian, count); });
}

uint64_t checked_count(FileCursor& file, const std::vector<uint64_t>& sizes, uint32_t bytes) {
  constexpr uint64_t kLongest = 1 << 30;  // an index must fit an int with room to spare
  const uint64_t most = file.remaining() / bytes;
  uint64_t count = 1;
  for (const uint64_t size : sizes) {
    if (size < 1 || size > kLongest) {
      file.fail(fmt::format("is damaged: a size of {}; expected 1 to {}", size, kLongest));
    }
    if (count > most / size) {
      file.fail(
          fmt::format("is cut short: its sizes need more than the {} samples of {} bytes that follow "
                      "byte {}",
                      most, bytes, file.position()));
    }
    count *= size;
  }
  return count;
}

Samples arranged(Samples in_file, const Vec3i& size, int channels, const SampleSteps& steps) {
  return std::visit(
      [&](const auto& from) -> Samples {
        std::remove_cvref_t<decltype(from)> to(from.size());
        size_t n = 0;
        for (uint64_t k = 0; k < uint64_t(size.z); ++k) {
          for (uint64_t j = 0; j < uint64_t(size.y); ++j) {
            for (uint64_t i = 0; i < uint64_t(size.x); ++i) {
              const uint64_t at = i * steps.x + j * steps.y + k * steps.z;
              for (uint64_t c = 0; c < uint64_t(channels); ++c) to[n++] = from[at + c * steps.channel];
            }
          }
        }
        return to;
      },
      in_file);
}

std::string stored_bytes(const Samples& samples, SampleType type) {
  return std::visit(
      [&](const auto& values) {
        return with_stored_type(type, [&](auto stored) {
          using Stored = decltype(stored);
          std::string bytes(values.size() * sizeof(Stored), '\0');
          for (size_t i = 0; i < values.size(); ++i) {
            if constexpr (std::is_same_v<Stored, half>) {
              stored = half(float(values[i]));
            } else {
              stored = Stored(values[i]);
            }
            std::memcpy(bytes.data() + i * sizeof stored, static_cast<const void*>(&stored), sizeof stored);
          }
          return bytes;
        });
      },
      samples);
}

}  // namespace pileus
