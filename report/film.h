#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

/// Films and pictures of the playback in a report.html.
namespace porthos::report {

/// What is filmed, and how.
struct FilmOptions {
  int width = 1280, height = 720;  ///< [pixels], even
  std::optional<double> from, to;  ///< simulated time [s]; none: its begin and its end
  std::optional<double> rate;      ///< simulated seconds per second; none: the whole in 20 s
  int fps = 30;                    ///< pictures per second
  std::string camera = "iso";      ///< iso, x, y, z
  /// What the camera follows: place, base, world. Empty: the world with a trail and where contacts
  /// touch the world, else the base's place.
  std::string ride;
  bool orbit = false;   ///< the planet and the orbit in place of the mechanism
  bool arrows = false;  ///< of momenta and forces
  bool dark = false;    ///< the dark theme
  bool trail = false;   ///< whole paths, not their last part
  /// Links, the paths of whose origins are drawn; empty: of the last links' centres of mass.
  std::vector<std::string> trail_of = {};
  bool text = true;                                ///< the time in a corner
  const std::atomic<bool>* stop = nullptr;         ///< true: give up
  std::function<void(double done)> progress = {};  ///< the share of the film, 0 to 1
};

/// Writes a film (.mp4), or the picture at `from` (.png), of the playback of a report by a Chromium
/// without a window: picture by picture, so that it is smooth however slow the machine is.
/// @param report  a report.html, or the folder of one: then a part of a run has a playback of its
///   own, of as many of its records as there is room for
/// @throws InvalidArgument for options out of range, a link that does not move, a name that ends
///   otherwise, a report without a playback, and if no browser is found
/// @return a remark where bodies turn far between two records of the playback; empty: they do not
/// @throws IoError if the browser fails or the file cannot be written
std::string write_film(const std::filesystem::path& report, const std::filesystem::path& out,
                       const FilmOptions& options);

}  // namespace porthos::report
