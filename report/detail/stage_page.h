#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "report/browser.h"
#include "report/film.h"

namespace porthos::report {

/// A report in a browser without a window, its playback ready and set as the options say.
/// @throws InvalidArgument for options out of range, a report without a playback, and if no browser
///   is found
/// @throws IoError if the browser fails
std::unique_ptr<BrowserPage> open_stage(const std::filesystem::path& report, const FilmOptions& o);

/// What a page gave as JSON of a base64 text.
std::string bytes_of_base64(const std::string& json);

}  // namespace porthos::report
