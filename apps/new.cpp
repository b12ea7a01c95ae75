#include <fmt/format.h>

#include <filesystem>

#include "apps/commands.h"
#include "apps/output.h"
#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/read/scene.h"
#include "scene/read/schema.h"
#include "scene/session/starter.h"

namespace porthos::apps {

namespace fs = std::filesystem;

int new_command(const Arguments& a) {
  using Base = mechanics::UrdfOptions::Base;
  std::optional<Base> base;
  if (a.base == "free") base = Base::free;
  if (a.base == "fixed") base = Base::fixed;
  if (a.base && !base)
    throw InvalidArgument(fmt::format("--base: base is '{}', expected fixed or free", *a.base));
  const fs::path urdf = a.scene, out = a.out.value_or("");
  const fs::path folder = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (a.out && fs::exists(out))
    throw InvalidArgument(fmt::format("{} is there already, expected a new file", out.string()));
  std::error_code e;
  // Both absolute: the folder need not be there yet.
  const fs::path relative = fs::relative(fs::absolute(urdf), fs::absolute(folder), e);
  const std::string text = scene::starter_scene(
      urdf.string(), e || relative.empty() ? urdf.string() : relative.string(), base);
  if (!a.out) {
    print(text);
    return exit_ok;
  }
  scene::make_folder(folder);
  scene::write_file(out, text);
  if (scene::read_scene(out.string()).urdf.accept_unphysical_inertia)
    fmt::print(stderr,
               "porthos: note: inertias of {} break the triangle inequality, as no body's do; the "
               "scene accepts them by unphysical_inertia, and porthos info names the links\n",
               urdf.string());
  fmt::print(stderr, "porthos: {} written; run it with: porthos run {}\n", out.string(),
             out.string());
  return exit_ok;
}

int schema_command(const Arguments& a) {
  print(a.markdown ? scene::schema_markdown() : scene::schema_json());
  return exit_ok;
}

}  // namespace porthos::apps
