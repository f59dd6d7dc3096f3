#include "vdb_io/node_unpacker.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <map>
#include <type_traits>

#include <Imath/half.h>
#include <blosc.h>
#include <zlib.h>

#include "vdb_io/value_coding.h"

namespace pileus {
namespace {

template <class T>
T load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// OpenVDB's negative(): of whole numbers, without overflow; the other one of truth values.
template <class T>
T negative(T value) {
  if constexpr (std::is_same_v<T, uint8_t>)
    return value == 0;
  else if constexpr (std::is_integral_v<T>)
    return T(0 - std::make_unsigned_t<T>(value));
  else
    return -value;
}

template <class T>
float as_float(T value) {
  if constexpr (std::is_same_v<T, uint8_t>)
    return value != 0 ? 1.0f : 0.0f;
  else
    return float(value);
}

/// Bytes that are taken one after the other, and end.
class Bytes {
 public:
  explicit Bytes(std::span<const char> rest) : m_rest(rest) {}

  size_t size() const { return m_rest.size(); }

  /// Null where there are not as many.
  const char* take(size_t count) {
    if (count > m_rest.size()) return nullptr;
    const char* taken = m_rest.data();
    m_rest = m_rest.subspan(count);
    return taken;
  }

 private:
  std::span<const char> m_rest;
};

bool unpack_blosc(std::span<const char> packed, std::span<char> target) {
  size_t bytes = 0;
  // Blosc is handed no length of its input: its header is held against what is there.
  return packed.size() >= BLOSC_MIN_HEADER_LENGTH &&
         ::blosc_cbuffer_validate(packed.data(), packed.size(), &bytes) == 0 && bytes == target.size() &&
         ::blosc_decompress_ctx(packed.data(), target.data(), target.size(), 1) == int(target.size());
}

bool unpack_zip(std::span<const char> packed, std::span<char> target) {
  uLongf bytes = target.size();
  const int status = ::uncompress(reinterpret_cast<Bytef*>(target.data()), &bytes,
                                  reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  return status == Z_OK && bytes == target.size();
}

/// The unpacked block: `count` bytes that stand in `in`, or in `room` where they had to be unpacked.
///   returns: null where the bytes are damaged
const char* unpack_block(Bytes& in, uint32_t compression, std::span<char> room) {
  if ((compression & (kZipped | kBlosc)) == 0) return in.take(room.size());
  const char* head = in.take(sizeof(int64_t));
  if (!head) return nullptr;
  const auto packed_bytes = load<int64_t>(head);
  if (packed_bytes <= 0) return packed_bytes == -int64_t(room.size()) ? in.take(room.size()) : nullptr;
  if (uint64_t(packed_bytes) > in.size()) return nullptr;
  const std::span packed(in.take(size_t(packed_bytes)), size_t(packed_bytes));
  const bool done = (compression & kBlosc) != 0 ? unpack_blosc(packed, room) : unpack_zip(packed, room);
  return done ? room.data() : nullptr;
}

/// Puts the active ones of eight values at their places. Returns what comes after them.
const float* spread_row(const float* from, uint64_t mask, uint64_t second,
                        const std::array<float, 2>& inactive, float* to) {
  if (mask == 0xff) {
    std::copy_n(from, 8, to);
    return from + 8;
  }
  for (int n = 0; n < 8; ++n) to[n] = inactive[second >> n & 1];
  for (; mask != 0; mask &= mask - 1) to[std::countr_zero(mask)] = *from++;
  return from;
}

/// Puts active values at their places, and inactive ones between them.
///   other: 1 where the second inactive value is meant; or null
void spread(const float* from, std::span<const uint64_t> active, const char* other,
            const std::array<float, 2>& inactive, float* to) {
  for (size_t w = 0; w < active.size(); ++w, to += 64) {
    const uint64_t mask = active[w], second = other ? load<uint64_t>(other + 8 * w) : 0;
    if (mask == ~uint64_t(0)) {
      std::copy_n(from, 64, to);
      from += 64;
    } else if (mask == 0 && second == 0) {
      std::fill_n(to, 64, inactive[0]);
    } else {
      for (int n = 0; n < 64; n += 8)
        from = spread_row(from, mask >> n & 0xff, second >> n & 0xff, inactive, to + n);
    }
  }
}

}  // namespace

size_t ValueCoding::value_bytes() const {
  switch (type) {
    case Type::float32:
    case Type::int32:
      return 4;
    case Type::float64:
    case Type::int64:
      return 8;
    case Type::boolean:
      break;
  }
  return 1;
}

std::optional<ValueCoding::Type> value_type_from(const std::string& name) {
  using Type = ValueCoding::Type;
  static const std::map<std::string, Type> kTypes{{"float", Type::float32},
                                                  {"double", Type::float64},
                                                  {"int32", Type::int32},
                                                  {"int64", Type::int64},
                                                  {"bool", Type::boolean}};
  const auto found = kTypes.find(name);
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

NodeUnpacker::NodeUnpacker(const ValueCoding& coding, std::span<const char> background)
    : m_coding(coding), m_background(background.begin(), background.end()) {}

float NodeUnpacker::value(const char* bytes) const {
  switch (m_coding.type) {
    case ValueCoding::Type::float32:
      return load<float>(bytes);
    case ValueCoding::Type::float64:
      return as_float(load<double>(bytes));
    case ValueCoding::Type::int32:
      return as_float(load<int32_t>(bytes));
    case ValueCoding::Type::int64:
      return as_float(load<int64_t>(bytes));
    case ValueCoding::Type::boolean:
      break;
  }
  return as_float(load<uint8_t>(bytes));
}

bool NodeUnpacker::unpack(std::span<const char> bytes, std::span<const uint64_t> active,
                          std::span<float> values) {
  switch (m_coding.type) {
    case ValueCoding::Type::float32:
      return unpack_as<float>(bytes, active, values);
    case ValueCoding::Type::float64:
      return unpack_as<double>(bytes, active, values);
    case ValueCoding::Type::int32:
      return unpack_as<int32_t>(bytes, active, values);
    case ValueCoding::Type::int64:
      return unpack_as<int64_t>(bytes, active, values);
    case ValueCoding::Type::boolean:
      break;
  }
  return unpack_as<uint8_t>(bytes, active, values);
}

template <class T>
bool NodeUnpacker::unpack_as(std::span<const char> bytes, std::span<const uint64_t> active,
                             std::span<float> values) {
  Bytes in(bytes);
  const char* head = in.take(1);
  if (!head) return false;
  const auto kind = InactiveValues(load<uint8_t>(head));
  if (kind > InactiveValues::all_stored) return false;

  const T background = load<T>(m_background.data());
  std::array<float, 2> inactive{
      as_float(kind == InactiveValues::background ? background : negative(background)), as_float(background)};
  for (int i = 0; i < stored_inactive_values(kind); ++i) {
    const char* stored = in.take(sizeof(T));
    if (!stored) return false;
    inactive[size_t(i)] = as_float(load<T>(stored));
  }
  const char* other = has_inactive_mask(kind) ? in.take(values.size() / 8) : nullptr;
  if (has_inactive_mask(kind) && !other) return false;

  size_t count = values.size();
  if (has_only_active_values(kind, m_coding.compression)) {
    count = 0;
    for (const uint64_t word : active) count += size_t(std::popcount(word));
  }
  // Where all values are stored as they are to be, they are unpacked to where they belong.
  const bool is_dense = count == values.size();
  if (!is_dense) m_active_values.resize(values.size());
  float* const floats = is_dense ? values.data() : m_active_values.data();
  const bool is_half = m_coding.is_half && std::is_floating_point_v<T>;
  const size_t block_bytes = count * (is_half ? 2 : sizeof(T));
  if (!(is_half && count == 0)) {  // of which OpenVDB writes nothing
    constexpr bool is_float = std::is_same_v<T, float>;
    if (!is_float || is_half) m_unpacked.resize(block_bytes);
    char* const room = is_float && !is_half ? reinterpret_cast<char*>(floats) : m_unpacked.data();
    const char* block = unpack_block(in, m_coding.compression, {room, block_bytes});
    if (!block) return false;
    if (is_half) {
      for (size_t i = 0; i < count; ++i)
        floats[i] = imath_half_to_float(load<imath_half_bits_t>(block + 2 * i));
    } else if (!is_float) {
      for (size_t i = 0; i < count; ++i) floats[i] = as_float(load<T>(block + sizeof(T) * i));
    } else if (block != room) {
      std::memcpy(room, block, block_bytes);
    }
  }
  if (!is_dense) spread(floats, active, other, inactive, values.data());
  return true;
}

}  // namespace pileus
