#include <fmt/format.h>

#include "apps/command_tools.h"
#include "apps/output.h"
#include "apps/progress.h"
#include "scene/files/files.h"
#include "scene/sensitivity/sensitivity.h"

namespace porthos::apps {

int sensitivity_command(const Arguments& a) {
  const scene::Scene s = read(a);
  scene::SensitivityRequest request;
  request.of = a.of;
  request.by = a.by;
  request.threads = a.threads;
  request.uncertainty =
      number_of("uncertainty", a.uncertainty, "a number, relative to each parameter");
  request.stop = &stop_on_signals();
  Progress progress;
  request.progress = [&](double done) { progress.update(done); };
  const scene::EndSensitivity r = scene::end_sensitivity(s, request);
  progress.finish();
  if (!r.failure.empty()) {
    log(r.failure);
    return request.stop->load() ? exit_interrupted : exit_numerical;
  }
  const std::string out = a.out.value_or(default_out(a) + "-sensitivity");
  scene::write_sensitivity(out, s, r);
  print(a.json ? scene::read_file(out + "/sensitivity.json")
               : scene::sensitivity_text(r, a.top.value_or(6)));
  log(fmt::format("{}/: sensitivity.json, sensitivity.csv, sensitivity.txt, sensitivity.svg", out));
  return exit_ok;
}

}  // namespace porthos::apps
