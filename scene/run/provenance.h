#pragma once
#include <string>
#include <utility>
#include <vector>

#include "scene/read/scene.h"

/// The provenance of a result.
namespace porthos::scene {

/// Name and value, in the order of a result file: versions, compiler, flags, processor, digests of
/// all files that were read.
using NamedTexts = std::vector<std::pair<std::string, std::string>>;
NamedTexts provenance(const Scene& scene);

/// What must agree so that a checkpoint can be continued bit for bit: every file the scene reads,
/// the options of the run, and the program with its revision.
NamedTexts fingerprint(const Scene& scene);

/// The differences between two fingerprints, for people: "the method was gauss16 and is gauss8
/// now". Empty if there are none.
std::string difference(const NamedTexts& before, const NamedTexts& now);

}  // namespace porthos::scene
