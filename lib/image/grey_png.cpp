#include "lib/image/grey_png.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>

#include <isa-l/igzip_lib.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/image/png_chunks.h"
#include "lib/image/png_filter.h"

namespace pileus {
namespace {

struct GreyHeader {
  int64_t width = 0, height = 0;
  size_t pixel = 0;  ///< [bytes], 1 or 2

  /// A row begins with the number of its filter.
  size_t row_bytes() const { return size_t(width) * pixel + 1; }
};

/// Goes on to the first chunk of pixels; nothing where something comes before it that this reader does not
/// know.
std::optional<GreyHeader> read_header(PngChunks& chunks) {
  constexpr size_t kSize = 13;
  std::array<uint8_t, kSize> header{};
  if (!chunks.next() || chunks.name() != "IHDR" || chunks.size() != kSize ||
      chunks.read(header.data(), kSize) != kSize)
    return std::nullopt;
  const auto number = [&](size_t at) {
    return int64_t(header[at]) << 24 | header[at + 1] << 16 | header[at + 2] << 8 | header[at + 3];
  };
  const int bits = header[8], colours = header[9], compression = header[10], filters = header[11],
            interlace = header[12];
  if ((bits != 8 && bits != 16) || colours != 0 || compression != 0 || filters != 0 || interlace != 0)
    return std::nullopt;
  while (chunks.next() && chunks.name() != "IDAT") {
    const bool may_be_ignored = (chunks.name()[0] & 0x20) != 0;
    if (!may_be_ignored || chunks.name() == "tRNS") return std::nullopt;
  }
  if (chunks.name() != "IDAT") return std::nullopt;
  return GreyHeader{number(0), number(4), size_t(bits / 8)};
}

/// ISA-L returns with the upper halves of vector registers in use. As long as they are, instructions on the
/// lower halves alone wait for what was there before: on a Zen 4 the rays of a picture took half as long
/// again.
void release_upper_halves() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx")) asm volatile("vzeroupper");
#endif
}

/// The filtered rows of a picture, as the chunks of pixels hold them compressed.
class RowStream {
 public:
  RowStream(const std::filesystem::path& file, PngChunks& chunks)
      : m_file(file), m_chunks(chunks), m_state(std::make_unique<inflate_state>()) {
    isal_inflate_init(m_state.get());
    m_state->crc_flag = ISAL_ZLIB;
  }

  void read(uint8_t* to, size_t count) {
    if (inflate_up_to(to, count) != count) damaged("the rows end too early");
  }

  /// Reads what comes behind the rows: the check sum, and other chunks.
  void finish() {
    uint8_t more = 0;
    if (inflate_up_to(&more, 1) != 0) damaged("there are more bytes than those of the rows");
    while (m_chunks.name() != "IEND") next_chunk();
    if (!m_chunks.finish()) damaged("it is cut short");
  }

 private:
  size_t inflate_up_to(uint8_t* to, size_t count) {
    m_state->next_out = to;
    m_state->avail_out = uint32_t(count);
    while (m_state->avail_out > 0 && m_state->block_state != ISAL_BLOCK_FINISH) {
      const uint32_t left = m_state->avail_out;
      const int status = isal_inflate(m_state.get());
      release_upper_halves();
      if (status != ISAL_DECOMP_OK && status != ISAL_END_INPUT) damaged("its pixels cannot be inflated");
      // It may have output to give when all input is taken.
      if (m_state->avail_in == 0 && m_state->avail_out == left && m_state->block_state != ISAL_BLOCK_FINISH)
        refill();
    }
    return count - m_state->avail_out;
  }

  void refill() {
    size_t count = 0;
    while ((count = m_chunks.read(m_input.data(), m_input.size())) == 0) {
      next_chunk();
      if (m_chunks.name() != "IDAT") damaged("the rows end too early");
    }
    m_state->next_in = m_input.data();
    m_state->avail_in = uint32_t(count);
  }

  void next_chunk() {
    if (!m_chunks.next()) damaged("it is cut short, or a check sum differs");
  }

  [[noreturn]] void damaged(const std::string& what) const {
    throw Error(ErrorKind::file, m_file.string(), "is damaged: " + what);
  }

  const std::filesystem::path& m_file;
  PngChunks& m_chunks;
  std::unique_ptr<inflate_state> m_state;
  std::array<uint8_t, 1 << 16> m_input{};
};

/// Turns filtered rows into numbers.
class RowNumbers {
 public:
  explicit RowNumbers(const GreyHeader& header) : m_header(header), m_above(header.row_bytes() - 1) {}

  bool write(uint8_t* row, float* to) {
    const int filter = *row++;
    if (!undo_png_filter(filter, m_header.pixel, m_above.data(), row, m_above.size())) return false;
    for (size_t x = 0; x < size_t(m_header.width); ++x)
      to[x] = float(m_header.pixel == 2 ? row[2 * x] << 8 | row[2 * x + 1] : row[x]);
    m_above.assign(row, row + m_above.size());
    return true;
  }

 private:
  const GreyHeader& m_header;
  std::vector<uint8_t> m_above;
};

}  // namespace

std::optional<NumberPlane> read_grey_png(const std::filesystem::path& file) {
  PngChunks chunks(file);
  if (!chunks.is_open()) return std::nullopt;
  const auto header = read_header(chunks);
  // The inflater counts in 32 bits.
  if (!header || uint64_t(header->height) > std::numeric_limits<uint32_t>::max() / header->row_bytes())
    return std::nullopt;
  check_plane_size(file, header->width, header->height, 1);
  NumberPlane plane{int(header->width), int(header->height), {}};
  plane.values.resize(size_t(plane.width) * size_t(plane.height));

  // While one band of rows becomes numbers, the next is inflated.
  constexpr size_t kBandBytes = size_t(1) << 19;
  const size_t row_bytes = header->row_bytes(), height = size_t(plane.height);
  const size_t rows = std::min(std::max(kBandBytes / row_bytes, size_t(1)), height);
  LargeArray<uint8_t> bands[2] = {make_large_array<uint8_t>(rows * row_bytes),
                                  make_large_array<uint8_t>(rows * row_bytes)};
  RowStream stream(file, chunks);
  RowNumbers numbers(*header);
  const auto inflate = [&](size_t first, uint8_t* band) {
    stream.read(band, (std::min(first + rows, height) - first) * row_bytes);
  };
  const auto undo = [&](size_t first, uint8_t* band) {
    for (size_t y = first; y < std::min(first + rows, height); ++y, band += row_bytes) {
      if (!numbers.write(band, plane.values.data() + y * size_t(plane.width)))
        throw Error(ErrorKind::file, file.string(), fmt::format("is damaged: row {} has no filter", y));
    }
  };
  inflate(0, bands[0].get());
  for (size_t first = 0; first < height; first += rows) {
    parallel_for(2, [&](size_t task) {
      if (task == 0) undo(first, bands[0].get());
      if (task == 1 && first + rows < height) inflate(first + rows, bands[1].get());
    });
    std::swap(bands[0], bands[1]);
  }
  stream.finish();
  return plane;
}

}  // namespace pileus
