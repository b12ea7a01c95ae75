#pragma once
#include <filesystem>
#include <string>

namespace porthos::report {

/// Writes an SVG document as it is (.svg), or by a Chromium without a window as a PDF of its size
/// (.pdf) or as pixels, 300 an inch (.png).
/// @throws InvalidArgument for a name that ends otherwise, and if no browser is found
/// @throws IoError if the browser fails or the file cannot be written
void write_figure(const std::string& svg, const std::filesystem::path& out);

}  // namespace porthos::report
