#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pileus {

/// How the values of a grid stand in its file.
struct ValueCoding {
  enum class Type { float32, float64, int32, int64, boolean };
  Type type = Type::float32;
  bool is_half = false;      ///< blocks hold 16-bit floats
  uint32_t compression = 0;  ///< flags: see value_coding.h

  /// Bytes of a value that stands alone, as the background does.
  size_t value_bytes() const;
};

/// "float", "double", …; nothing for types that are no numbers.
std::optional<ValueCoding::Type> value_type_from(const std::string& name);

/// Unpacks the values of one node after another as OpenVDB does, and makes floats of them. One per thread.
class NodeUnpacker {
 public:
  /// background: value_bytes() of it
  NodeUnpacker(const ValueCoding& coding, std::span<const char> background);

  /// A value that stands alone, as float.
  float value(const char* bytes) const;

  /// All values of a node; those at the places of its children mean nothing.
  ///   bytes: from the byte of InactiveValues to the end of the block; nothing in it is trusted
  ///   active: the node's mask, a bit for each of `values`
  /// returns: false where the bytes are damaged
  bool unpack(std::span<const char> bytes, std::span<const uint64_t> active, std::span<float> values);

 private:
  template <class T>
  bool unpack_as(std::span<const char> bytes, std::span<const uint64_t> active, std::span<float> values);

  ValueCoding m_coding;
  std::vector<char> m_background;
  std::vector<char> m_unpacked;
  std::vector<float> m_active_values;
};

}  // namespace pileus
