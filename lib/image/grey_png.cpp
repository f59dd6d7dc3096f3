#include "lib/image/grey_png.h"

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include <png.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

/// What libpng says before it gives up: it then jumps back, over frames that own nothing.
struct Complaint {
  char text[160] = "";
};

[[noreturn]] void give_up(png_structp png, png_const_charp message) {
  auto* complaint = static_cast<Complaint*>(png_get_error_ptr(png));
  std::snprintf(complaint->text, sizeof(complaint->text), "%s", message);
  png_longjmp(png, 1);
}

void ignore(png_structp, png_const_charp) {}

bool read_header(png_structp png, png_infop info, std::FILE* stream) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_init_io(png, stream);
  png_read_info(png, info);
  return true;
}

bool read_row(png_structp png, unsigned char* row) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_row(png, row, nullptr);
  return true;
}

bool read_end(png_structp png) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_end(png, nullptr);
  return true;
}

class Reader {
 public:
  Reader() : m_png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &m_complaint, give_up, ignore)) {
    if (m_png) m_info = png_create_info_struct(m_png);
  }
  ~Reader() { png_destroy_read_struct(&m_png, &m_info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  bool is_ready() const { return m_info != nullptr; }
  bool open(std::FILE* stream) { return read_header(m_png, m_info, stream); }

  bool is_plain_grey() const {
    const int bits = png_get_bit_depth(m_png, m_info);
    return png_get_color_type(m_png, m_info) == PNG_COLOR_TYPE_GRAY && (bits == 8 || bits == 16) &&
           png_get_interlace_type(m_png, m_info) == PNG_INTERLACE_NONE &&
           png_get_valid(m_png, m_info, PNG_INFO_tRNS) == 0;
  }
  int64_t width() const { return png_get_image_width(m_png, m_info); }
  int64_t height() const { return png_get_image_height(m_png, m_info); }

  bool read(NumberPlane& plane) {
    const bool is_wide = png_get_bit_depth(m_png, m_info) == 16;
    std::vector<unsigned char> row(size_t(plane.width) * (is_wide ? 2 : 1));
    for (int y = 0; y < plane.height; ++y) {
      if (!read_row(m_png, row.data())) return false;
      float* to = plane.values.data() + size_t(y) * size_t(plane.width);
      for (size_t x = 0; x < size_t(plane.width); ++x)
        to[x] = float(is_wide ? row[2 * x] << 8 | row[2 * x + 1] : row[x]);
    }
    return read_end(m_png);
  }

  const char* complaint() const { return m_complaint.text; }

 private:
  Complaint m_complaint;
  png_structp m_png = nullptr;
  png_infop m_info = nullptr;
};

}  // namespace

std::optional<NumberPlane> read_grey_png(const std::filesystem::path& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), std::fclose);
  Reader reader;
  if (!stream || !reader.is_ready() || !reader.open(stream.get()) || !reader.is_plain_grey())
    return std::nullopt;
  check_plane_size(file, reader.width(), reader.height(), 1);
  NumberPlane plane{int(reader.width()), int(reader.height()), {}};
  plane.values.resize(size_t(plane.width) * size_t(plane.height));
  if (!reader.read(plane)) {
    throw Error(ErrorKind::file, file.string(), fmt::format("is damaged: {}", reader.complaint()));
  }
  return plane;
}

}  // namespace pileus
