#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "mechanics/mechanism.h"
#include "report/film.h"

namespace porthos::report {

/// Pictures of a mechanism in any pose, drawn as the playback of a report of the same mechanism
/// draws it, by a browser that stays open.
class LivePicture {
 public:
  /// @param report  the report.html of any run of the mechanism
  /// @param options  those of a picture: size, camera, ride, dark
  /// @throws InvalidArgument as write_film()
  /// @throws IoError as write_film()
  LivePicture(std::shared_ptr<const mechanics::Mechanism> mechanism,
              const std::filesystem::path& report, const FilmOptions& options);
  ~LivePicture();

  /// height × width × 3 bytes: red, green and blue of each pixel, rows from the top.
  /// @param q  coordinates, nq numbers
  /// @throws InvalidArgument for another size, or a report of another mechanism
  /// @throws IoError if the browser fails
  std::vector<std::uint8_t> picture(std::span<const double> q);
  int width() const { return width_; }    ///< [pixels]
  int height() const { return height_; }  ///< [pixels]

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  int width_, height_;
};

}  // namespace porthos::report
