#pragma once

namespace porthos::scene {

/// Measures of a picture, in `unit`.
struct Look {
  const char* unit;
  double width, left, right;    ///< of the page, and where panels begin and end
  double head, gap, foot;       ///< above, between and below panels
  double name_at;               ///< of a panel's name, turned upwards
  double ticks, names, legend;  ///< sizes of texts
  double row, swatch;           ///< of the legend
  double stroke, rule;          ///< widths of lines and of the grid
  bool beside;                  ///< whether the legend is right of its panel, else above it
};
inline constexpr double points_in_mm = 72 / 25.4;
inline constexpr Look look_on_screen{"",   1180, 96, 850, 92, 40,  62, 22,
                                     12.5, 13,   12, 19,  24, 1.8, 1,  true};
inline constexpr Look look_in_print{
    "pt", 85 * points_in_mm, 42, 85 * points_in_mm - 6, 0, 0, 0, 7, 8, 8, 8, 10.5, 18, 1, 0.5,
    false};
inline constexpr double height_in_print = 60 * points_in_mm;
/// Of the curves below a legend of many names.
inline constexpr double least_in_print = 0.6 * height_in_print;

}  // namespace porthos::scene
