#include "tests/fuzz/base.h"

#include "tests/places.h"

namespace porthos::test::fuzz {

Base::Base() {
  write_bytes(folder_ / "arm.urdf", arm_urdf("<dynamics damping='0.3'/>"));
  write_bytes(folder_ / "scene.toml",
              "title = 'arm'\n[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[environment]\n"
              "gravity = 'uniform'\nvector = [0, 0, -9.81]\n[initial]\n"
              "joints.shoulder = { position = 1.2 }\n[integrator]\nmethod = 'gauss8'\n"
              "step = 0.01\n[run]\nduration = 0.1\nrecord_every = 0.02\n[verify]\nenergy = 1e-9\n");
  const auto scene = scene::read_scene((folder_ / "scene.toml").string());
  arm_ = {scene, scene::assemble(scene)};
  scene::run(arm_.scene, arm_.assembly, into(finished()));
  auto half = into(stopped());
  half.stop_at = 5;
  scene::run(arm_.scene, arm_.assembly, half);
  for (const fs::path& from : {finished(), stopped() / "checkpoint"})
    for (const auto& entry : fs::directory_iterator(from))
      if (entry.is_regular_file()) kept_[entry.path()] = read_bytes(entry.path());
}

// Not by fs::copy: the timer of libFuzzer interrupts it.
void Base::restore(const fs::path& folder) const {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [path, bytes] : kept_)
    if (path.parent_path() == folder) write_bytes(path, bytes);
}
void Base::restore_finished() const { restore(finished()); }
void Base::restore_stopped() const {
  fs::remove_all(stopped());
  restore(stopped() / "checkpoint");
}

std::string Base::file(const std::string& name, const std::string& bytes) const {
  write_bytes(folder_ / name, bytes);
  return (folder_ / name).string();
}

const Base& base() {
  static const Base made;
  return made;
}

std::string from_source(const std::string& path) {
  return read_bytes(fs::path(PORTHOS_SOURCE_DIR) / path);
}

}  // namespace porthos::test::fuzz
