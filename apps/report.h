#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "apps/commands.h"

namespace porthos::apps {

/// Writes out/report.html from the results in `out`, unless --no-report is given; an older one goes
/// in any case. If the page cannot be made, a message goes to stderr, and the verdict of the run
/// does not change. Missing meshes are told on stderr too, unless --no-meshes leaves them out.
/// @param models  folders of the model files, for the meshes they name
/// @return whether it was written; false without a message if there is no template
bool make_report(const Arguments& arguments, const std::string& out,
                 const std::vector<std::filesystem::path>& models = {});

/// The page of the results in DIR, with --models FOLDER; what it does not show of their meshes goes
/// to stderr. @throws InvalidArgument as report::write_report(), and without a template
void write_page(const Arguments& arguments, const std::filesystem::path& file);

}  // namespace porthos::apps
