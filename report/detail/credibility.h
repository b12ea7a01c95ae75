#pragma once
#include "report/detail/series.h"
#include "scene/read/scene.h"

namespace porthos::report {

/// What a run states about the credibility factors of a simulation, named after NASA-STD-7009A
/// (2016), section 4.4. Nothing is graded: a reviewer assigns levels.
/// @param summary  summary.json;  comparison  compare.json of the same scene or null;  scene may be
///   null
/// @return array of {factor, stands: "stated" | "partly" | "not stated", text}
Json credibility(const Json& summary, const Json& comparison, const scene::Scene* scene);

}  // namespace porthos::report
