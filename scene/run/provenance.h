#pragma once
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scene/read/scene.h"

/// Where a result came from.
namespace porthos::scene {

/// SHA-256, 64 hexadecimal digits.
std::string sha256(std::string_view bytes);

/// Name and value, in the order of a result file: versions, compiler, flags, processor, digests of
/// all files that were read.
using NamedTexts = std::vector<std::pair<std::string, std::string>>;
NamedTexts provenance(const Scene& scene);

/// What must agree for a checkpoint to be continued bit for bit: every file the scene reads, what
/// was asked for, and the program with its revision.
NamedTexts fingerprint(const Scene& scene);

/// What differs between two fingerprints, for people: "the method was gauss16 and is gauss8 now".
/// Empty: nothing.
std::string difference(const NamedTexts& before, const NamedTexts& now);

}  // namespace porthos::scene
