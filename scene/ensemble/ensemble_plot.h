#pragma once
#include <filesystem>
#include <string>

namespace porthos::scene {

/// The distribution of the errors of the cases, as an SVG document: a histogram per invariant on a
/// logarithmic axis, with the median, the 95 % quantile and the limit of the verdict; and one per
/// requirement, of the number it limits at the records.
/// @param h5, json  ensemble.h5 and the text of ensemble.json
/// @throws InvalidArgument if one of them is damaged
std::string ensemble_plot(const std::filesystem::path& h5, const std::string& json);

/// Draws ensemble.svg in the results folder of a finished ensemble again. @return its path
/// @throws InvalidArgument as ensemble_plot(), and for a folder without a finished ensemble
std::string replot_ensemble(const std::filesystem::path& folder);

}  // namespace porthos::scene
