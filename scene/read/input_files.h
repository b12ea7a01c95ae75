#pragma once
#include <map>
#include <string>

namespace porthos::scene {

/// The files that a scene names besides its own and those of its models: contents, by the names in
/// the scene. Results store them, so that they can be read again where the files are gone.
using InputFiles = std::map<std::string, std::string>;

/// As one text, a JSON object.
std::string to_text(const InputFiles& files);
/// @param text as to_text() gives it; empty: no files. @throws InvalidArgument otherwise
InputFiles input_files(const std::string& text);

}  // namespace porthos::scene
