#pragma once
#include <string>

namespace porthos::apps {

/// The text of `porthos methods`: the catalogue as a table.
std::string methods_text();
/// The same as one JSON object, with families, needs and sources (`porthos methods --json`).
std::string methods_json();
/// The same as the page docs/methods.md, with sources (`porthos methods --markdown`).
std::string methods_markdown();

}  // namespace porthos::apps
