#include "scene/read/input_files.h"

#include <nlohmann/json.hpp>

#include "phs/error.h"

namespace porthos::scene {

std::string to_text(const InputFiles& files) {
  // A file with bytes that are no UTF-8 keeps its digest in the provenance, not each of its bytes.
  return nlohmann::json(files).dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

InputFiles input_files(const std::string& text) {
  InputFiles files;
  if (text.empty()) return files;
  const auto j = nlohmann::json::parse(text, nullptr, false);
  if (!j.is_object()) throw InvalidArgument("the files kept with the results are no JSON object");
  for (const auto& [name, content] : j.items()) {
    if (!content.is_string())
      throw InvalidArgument("the file '" + name + "' kept with the results is no text");
    files[name] = content;
  }
  return files;
}

}  // namespace porthos::scene
