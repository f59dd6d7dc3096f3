#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

// What libpileus and libpileus_pictures say to each other. Pictures that are not EXR go through OpenImageIO,
// whose start costs more than many a render: it lies in a library of its own, loaded with the first of them
// (lib/image/load_pictures.h).
namespace pileus {

inline constexpr const char* kPicturesFile = "libpileus_pictures.so";

/// How the stored values of a picture follow from linear ones.
enum class StoredCurve { linear, srgb, gamma };

struct PictureHeader {
  int width = 0;
  int height = 0;
  int depth = 1;                      ///< above 1, the file holds a volume
  std::vector<std::string> channels;  ///< in the order of the values
  int alpha_channel = -1;
  bool is_straight = false;  ///< the colours are not multiplied by alpha
  StoredCurve curve = StoredCurve::linear;
  double gamma = 1.0;  ///< for StoredCurve::gamma: linear = stored^gamma
  std::string comments;
};

/// A picture file whose header has been read. Destroyed by the library that made it.
class PictureReader {
 public:
  virtual ~PictureReader() = default;
  virtual const PictureHeader& header() const = 0;

  /// Reads values[height][width][channels] as stored, 1 being the largest integer; false with a reason where
  /// the file is damaged.
  virtual bool read(float* values, std::string& reason) = 0;

  /// The same with whole numbers as they are, -9999 and 65535 included.
  virtual bool read_numbers(float* values, std::string& reason) = 0;
};

struct PngPicture {
  int width = 0;
  int height = 0;
  const uint8_t* rgb = nullptr;  ///< rgb[height][width][3]
  StoredCurve curve = StoredCurve::srgb;
  double gamma = 1.0;    ///< as in PictureHeader
  std::string comments;  ///< "": none
};

/// What the library does. It knows nothing of pileus::Error: where it fails, it gives a reason.
class Pictures {
 public:
  /// Null with a reason where the file is no picture.
  virtual std::unique_ptr<PictureReader> open(const std::string& file, std::string& reason) const = 0;
  virtual bool write_png(const std::string& file, const PngPicture& picture, std::string& reason) const = 0;

 protected:
  ~Pictures() = default;
};

}  // namespace pileus

/// The version of pileus that the library was built with: classes cross this border, so it must be the same.
extern "C" const char* pileus_pictures_version();
extern "C" const pileus::Pictures* pileus_pictures();
