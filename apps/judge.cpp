#include <fmt/format.h>

#include <filesystem>

#include "apps/command_tools.h"
#include "apps/report.h"
#include "apps/verdict.h"
#include "scene/files/files.h"
#include "scene/judge/judge_file.h"

namespace porthos::apps {

int judge_command(const Arguments& a) {
  const std::string name = std::filesystem::path(a.scene).stem().string();
  const std::string out = a.out.value_or("results/" + name + "-judge");
  const auto r = scene::judge_file({a.scene, a.model, a.map.value_or(""), out, log});
  const bool report = make_report(a, out);
  fmt::print("{}", a.json ? scene::read_file(out + "/summary.json") : verdict_text(r, out, report));
  return exit_code(r.verdict());
}

}  // namespace porthos::apps
