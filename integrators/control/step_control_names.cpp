#include "integrators/control/step_control.h"

namespace porthos::integrators {

const char* to_string(StepControl c) {
  switch (c) {
    case StepControl::fixed:
      return "fixed";
    case StepControl::time_transformed:
      return "time_transformed";
    case StepControl::reversible:
      return "reversible";
  }
  return "unknown";
}

StepControl step_control_of(const std::string& name) {
  for (const auto c : {StepControl::fixed, StepControl::time_transformed, StepControl::reversible})
    if (name == to_string(c)) return c;
  throw InvalidArgument("unknown step control '" + name +
                        "', expected one of fixed, time_transformed, reversible");
}

}  // namespace porthos::integrators
