#pragma once
#include <string>

#include "scene/plan/plan.h"

namespace porthos::apps {

/// What porthos plan prints. out: the results folder
std::string plan_text(const scene::PlanReport& report, const std::string& title,
                      const std::string& out);

}  // namespace porthos::apps
