#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>

#include "lib/core/error.h"
#include "vdb_io/dense/dense_files.h"
#include "vdb_io/dense/file_pair.h"
#include "vdb_io/file_cursor.h"

namespace pileus {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr uint32_t kLongestHeader = 1 << 16;  // [bytes]

/// What the dictionary in front of the numbers says.
struct ArrayInfo {
  SampleType type = SampleType::float32;
  bool big_endian = false;
  bool fortran_order = false;
  std::vector<uint64_t> shape;
};

/// Reads the dictionary, a literal of Python: {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }.
class DictionaryParser {
 public:
  DictionaryParser(const FileCursor& file, const std::string& text, uint64_t begin)
      : m_file(file), m_text(text), m_begin(begin) {}

  ArrayInfo parse() {
    expect('{');
    while (!next_is('}')) {
      const std::string key = quoted();
      expect(':');
      value_of(key);
      if (!next_is(',')) break;
      ++m_at;
    }
    expect('}');
    skip_space();
    if (m_at != m_text.size()) fail("the end of the header");
    if (!m_has_type || !m_has_order || !m_has_shape) {
      fail("'descr', 'fortran_order' and 'shape', each once");
    }
    return m_info;
  }

 private:
  [[noreturn]] void fail(const std::string& expected) const {
    const std::string found = m_text.substr(m_at, 16);
    std::string printable;
    for (const char c : found) printable += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
    m_file.fail(
        fmt::format("is damaged: found \"{}\" at byte {}; expected {}", printable, m_begin + m_at, expected));
  }

  /// NumPy has many types, and int64 is its default for whole numbers: nothing is wrong with the file.
  [[noreturn]] void fail_type(const std::string& type, size_t begin) const {
    m_file.fail(
        fmt::format("has the type \"{}\" at byte {}; expected floats of 16, 32 or 64 bits, or whole "
                    "numbers of 8, 16 or 32, as array.astype('float32') makes them",
                    type.substr(0, 32), m_begin + begin));
  }

  void skip_space() {
    while (m_at < m_text.size() && (m_text[m_at] == ' ' || m_text[m_at] == '\n')) ++m_at;
  }
  bool next_is(char c) {
    skip_space();
    return m_at < m_text.size() && m_text[m_at] == c;
  }
  void expect(char c) {
    if (!next_is(c)) fail(fmt::format("'{}'", c));
    ++m_at;
  }
  bool take(std::string_view word) {
    skip_space();
    if (m_text.compare(m_at, word.size(), word) != 0) return false;
    m_at += word.size();
    return true;
  }

  std::string quoted() {
    skip_space();
    const char quote = m_at < m_text.size() ? m_text[m_at] : '\0';
    const size_t end = quote == '\'' || quote == '"' ? m_text.find(quote, m_at + 1) : std::string::npos;
    if (end == std::string::npos) fail("a quoted text");
    const std::string text = m_text.substr(m_at + 1, end - m_at - 1);
    m_at = end + 1;
    return text;
  }

  void value_of(const std::string& key) {
    if (key == "descr" && !m_has_type) {
      m_has_type = true;
      skip_space();
      const size_t begin = m_at;
      const std::string type = quoted();
      if (!set_type(type)) fail_type(type, begin);
    } else if (key == "fortran_order" && !m_has_order) {
      m_has_order = true;
      m_info.fortran_order = take("True");
      if (!m_info.fortran_order && !take("False")) fail("True or False");
    } else if (key == "shape" && !m_has_shape) {
      m_has_shape = true;
      shape();
    } else {
      fail("'descr', 'fortran_order' and 'shape', each once");
    }
  }

  bool set_type(const std::string& text) {
    if (text.size() != 3) return false;
    const std::string_view kind = std::string_view(text).substr(1);
    m_info.big_endian = text[0] == '>';
    const bool has_order = text[0] == '<' || text[0] == '>' || text[0] == '=' || text[0] == '|';
    constexpr std::array<std::pair<std::string_view, SampleType>, 10> kKinds{{{"b1", SampleType::uint8},
                                                                              {"u1", SampleType::uint8},
                                                                              {"i1", SampleType::int8},
                                                                              {"u2", SampleType::uint16},
                                                                              {"i2", SampleType::int16},
                                                                              {"u4", SampleType::uint32},
                                                                              {"i4", SampleType::int32},
                                                                              {"f2", SampleType::float16},
                                                                              {"f4", SampleType::float32},
                                                                              {"f8", SampleType::float64}}};
    for (const auto& [name, type] : kKinds) {
      if (kind != name) continue;
      m_info.type = type;
      return has_order;
    }
    return false;
  }

  void shape() {
    constexpr size_t kMostAxes = 8;
    expect('(');
    while (!next_is(')')) {
      uint64_t size = 0;
      const char* begin = m_text.data() + m_at;
      const auto [end, error] = std::from_chars(begin, m_text.data() + m_text.size(), size);
      if (error != std::errc() || m_info.shape.size() >= kMostAxes) fail("a size");
      m_at += size_t(end - begin);
      m_info.shape.push_back(size);
      if (!next_is(',')) break;
      ++m_at;
    }
    expect(')');
  }

  const FileCursor& m_file;
  const std::string& m_text;
  uint64_t m_begin;  ///< of the text in the file
  size_t m_at = 0;
  ArrayInfo m_info;
  bool m_has_type = false, m_has_order = false, m_has_shape = false;
};

ArrayInfo read_array_info(FileCursor& file) {
  std::array<char, 6> magic;
  if (file.size() < 10) file.fail(fmt::format("is no .npy file: {} bytes", file.size()));
  file.read(magic.data(), magic.size(), "the magic text");
  if (std::string_view(magic.data(), magic.size()) != kMagic) {
    file.fail("does not start as NumPy's files do; expected a .npy file (an .npz is a zip archive of them)");
  }
  const auto major = file.get<uint8_t>("the version");
  file.skip(1, "the version");
  if (major < 1 || major > 3) file.fail(fmt::format("has version {} at byte 6; expected 1, 2 or 3", major));
  const uint32_t length =
      major == 1 ? file.get<uint16_t>("the header's length") : file.get<uint32_t>("the header's length");
  if (length > kLongestHeader) {
    file.fail(fmt::format("is damaged: a header of {} bytes at byte 8; expected {} at most", length,
                          kLongestHeader));
  }
  const uint64_t begin = file.position();
  std::string text(std::min<uint64_t>(length, file.remaining()), '\0');
  if (text.size() < length) file.fail(fmt::format("is cut short in its header, at byte {}", file.size()));
  file.read(text.data(), text.size(), "the header");
  return DictionaryParser(file, text, begin).parse();
}

/// Steps along x, y, z and the channels in an array of the given shape.
SampleSteps steps_of(const std::vector<uint64_t>& shape, bool fortran_order) {
  std::array<uint64_t, 4> steps{1, 1, 1, 1};
  if (fortran_order) {
    for (size_t axis = 1; axis < 4; ++axis) steps[axis] = steps[axis - 1] * shape[axis - 1];
  } else {
    for (size_t axis = 3; axis-- > 0;) steps[axis] = steps[axis + 1] * shape[axis + 1];
  }
  return {steps[0], steps[1], steps[2], steps[3]};
}

std::string array_head(const DenseVolume& volume) {
  const char* kind = volume.stored == SampleType::float64   ? "<f8"
                     : volume.stored == SampleType::float16 ? "<f2"
                                                            : "<f4";
  std::string text =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}, {}{}), }}", kind, volume.size.x,
                  volume.size.y, volume.size.z, volume.channels == 3 ? ", 3" : "");
  constexpr size_t kAlignment = 64, kPreamble = 10;
  while ((kPreamble + text.size() + 1) % kAlignment != 0) text += ' ';
  text += '\n';
  std::string head(kMagic);
  head += {'\x01', '\x00', char(text.size() & 0xff), char(text.size() >> 8)};
  return head + text;
}

}  // namespace

DenseVolume read_npy(const std::filesystem::path& path, DenseRead what) {
  FileCursor file(path);
  ArrayInfo info = read_array_info(file);
  std::vector<uint64_t>& shape = info.shape;
  const bool is_box = shape.size() == 3 || (shape.size() == 4 && (shape[3] == 1 || shape[3] == 3));
  if (!is_box) {
    file.fail(
        fmt::format("holds an array of {} axes; expected array[x, y, z] or array[x, y, z, 3]", shape.size()));
  }
  shape.resize(4, 1);
  const uint64_t count = checked_count(file, shape, bytes_of(info.type));
  if (file.remaining() != count * bytes_of(info.type)) {
    file.fail(fmt::format("has {} bytes after its {} samples", file.remaining() - count * bytes_of(info.type),
                          count));
  }
  DenseVolume volume;
  volume.size = Vec3i(int(shape[0]), int(shape[1]), int(shape[2]));
  volume.channels = int(shape[3]);
  volume.stored = info.type;
  if (const auto header = read_volume_header(path)) {
    check_header_fits(path, *header, volume.size, volume.channels, what == DenseRead::all);
    volume.header = *header;
  } else if (volume.channels == 3) {
    volume.header.grid = "vector";
    volume.header.grid_class = "unknown";
  }
  if (what == DenseRead::head) return volume;
  volume.samples = arranged(read_samples(file, info.type, info.big_endian, count), volume.size,
                            volume.channels, steps_of(shape, info.fortran_order));
  return volume;
}

void write_npy(const std::filesystem::path& path, const DenseVolume& volume) {
  PILEUS_CHECK(volume.stored == SampleType::float16 || volume.stored == SampleType::float32 ||
               volume.stored == SampleType::float64);
  VolumeHeader header = volume.header;
  header.type = name_of(volume.stored);
  header.big_endian = false;
  header.z_fastest = true;
  header.size = volume.size;
  header.channels = volume.channels;
  header.value_scale.reset();
  // Turned about, x and z exchanged, the order of DenseVolume is C order.
  const uint64_t c = uint64_t(volume.channels), x = uint64_t(volume.size.x), y = uint64_t(volume.size.y);
  const Vec3i turned(volume.size.z, volume.size.y, volume.size.x);
  const Samples in_c_order = arranged(volume.samples, turned, volume.channels, {x * y * c, x * c, c, 1});
  write_with_header(path, array_head(volume) + stored_bytes(in_c_order, volume.stored), header);
}

}  // namespace pileus
