#pragma once
#include <filesystem>
#include <string>

#include "scene/run/record_log.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Writes aside(path): the record log as HDF5, in chunks of constant memory. Contents:
/// docs/results.md.
/// @throws IoError "cannot write <path>: ..."
void write_run_file(const std::filesystem::path& path, const Scene& scene, const Assembly& assembly,
                    const RunReport& report, const std::filesystem::path& log);

}  // namespace porthos::scene
