#include <fmt/format.h>

#include "apps/command_tools.h"
#include "apps/output.h"
#include "apps/report.h"
#include "scene/files/files.h"
#include "scene/identification/identification.h"

namespace porthos::apps {
namespace {

/// "1e-4", or "joint_1.velocity=1e-4".
scene::LogNoise noise_of(const std::vector<std::string>& sigmas) {
  scene::LogNoise noise;
  for (const auto& text : sigmas) {
    const auto sign = text.find('=');
    const auto value = number_of("sigma", text.substr(sign == std::string::npos ? 0 : sign + 1),
                                 "a standard deviation in the unit of the column");
    if (sign == std::string::npos)
      noise.of_all = value;
    else
      noise.by_name[text.substr(0, sign)] = *value;
  }
  return noise;
}

}  // namespace

int identify_command(const Arguments& a) {
  const scene::Scene s = read(a);
  scene::IdentificationRequest request;
  request.parameters = a.parameters;
  request.noise = noise_of(a.sigma);
  request.stop = &stop_on_signals();
  request.say = log;
  request.tell = [](const scene::FitProgress& p) {
    log(fmt::format("iteration {}, run {}: mean square {:.4g} up to {:g} s", p.iterations, p.runs,
                    p.mean_square, p.until));
  };
  const scene::Identification r = scene::identify(s, a.log, request);
  if (!r.failure.empty()) {
    log(r.failure);
    return request.stop->load() ? exit_interrupted : exit_numerical;
  }
  const std::string out = a.out.value_or(default_out(a) + "-identified");
  scene::write_identification(out, s, r);
  const bool page = make_report(a, out);
  print(a.json ? scene::read_file(out + "/identify.json") : scene::identification_text(r));
  log(fmt::format("{}/: found.toml, identify.json, identify.txt, identify.svg{}", out,
                  page ? ", report.html" : ""));
  return r.converged ? exit_ok : exit_numerical;
}

}  // namespace porthos::apps
