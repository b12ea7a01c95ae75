#pragma once
#include <string>
#include <string_view>

namespace porthos::scene {

/// SHA-256, 64 hexadecimal digits. @throws InvalidArgument if OpenSSL does not offer it
std::string sha256(std::string_view bytes);

}  // namespace porthos::scene
