// Bytes of an unfinished run that are turned over or missing: the last sound checkpoint continues
// to the bytes of the run that nothing happened to, or one sentence refuses.
#include <cstdlib>

#include "report/report.h"
#include "scene/files/hdf5_reader.h"
#include "scene/run/checkpoint.h"
#include "tests/run/scenes.h"

namespace porthos::test::damage_test {
namespace {

/// A run of 12 steps that was stopped after 6: a checkpoint at the start, one at step 6.
struct Halves {
  TemporaryFolder folder;
  Case c = pendulum(folder, 0.3);
  fs::path out = folder / "out", checkpoint = out / "checkpoint", state = checkpoint / "state.bin",
           before = checkpoint / "state.old", log = checkpoint / "records.bin";
  std::string said, whole;

  Halves() {
    c.scene.duration = 0.12;
    scene::run(c.scene, c.assembly, into(folder / "whole"));
    whole = read_bytes(folder / "whole" / "run.h5");
    auto options = into(out);
    options.stop_at = 6;
    scene::run(c.scene, c.assembly, options);
    fs::copy(checkpoint, folder / "kept");
  }
  /// Puts the checkpoint back as it was.
  void again() {
    fs::remove_all(out);
    fs::create_directories(out);
    fs::copy(folder / "kept", checkpoint);
    said.clear();
  }
  /// Continues the run. @returns the sentence that refuses it, or ""
  std::string resume(std::int64_t stop_at = -1) {
    auto options = into(out, true);
    options.stop_at = stop_at;
    options.say = [&](const std::string& text) { said = text; };
    return refusal([&] { scene::run(c.scene, c.assembly, options); });
  }
  bool has_the_same_bytes() const { return read_bytes(out / "run.h5") == whole; }
};

/// Turns over a byte of a file at places that are `by` apart, and resumes.
struct Counts {
  int tried = 0, refused = 0, continued = 0, other = 0;
};
Counts with_each_byte_turned_over(Halves& h, const fs::path& path, size_t by, bool keep_before) {
  Counts n;
  h.again();
  const std::string bytes = read_bytes(path);
  for (size_t at = 0; at < bytes.size(); at += by) {
    h.again();
    if (!keep_before) fs::remove(h.before);
    std::string wrong = bytes;
    wrong[at] = char(wrong[at] ^ (1 << (at % 8)));
    write_bytes(path, wrong);
    ++n.tried;
    const std::string text = h.resume();
    if (!text.empty()) {
      ++n.refused;
      EXPECT_TRUE(says(text, h.checkpoint.string()));
      EXPECT_EQ(text.find('\n'), text.npos);
      EXPECT_FALSE(fs::exists(h.out / "run.h5"));
    } else if (h.has_the_same_bytes()) {
      ++n.continued;
      EXPECT_TRUE(says(h.said, "the run continues from the checkpoint before it, at step 0"));
    } else {
      ++n.other;
      ADD_FAILURE() << "byte " << at << " of " << path << " gives another result";
    }
  }
  std::printf("  %-11s of %zu bytes: %d turned over, %d refused, %d continued to the same bytes\n",
              path.filename().c_str(), bytes.size(), n.tried, n.refused, n.continued);
  return n;
}

size_t apart(size_t most) { return std::getenv("PORTHOS_LONG") ? 1 : most; }

TEST(Damage, AByteOfTheLastCheckpointCostsTheStepsSinceTheOneBefore) {
  Halves h;
  const Counts n = with_each_byte_turned_over(h, h.state, apart(41), true);
  EXPECT_EQ(n.continued, n.tried);
  EXPECT_GT(n.tried, 30);
}

TEST(Damage, AByteOfTheOnlyCheckpointIsRefused) {
  Halves h;
  const Counts n = with_each_byte_turned_over(h, h.state, apart(7), false);
  EXPECT_EQ(n.refused, n.tried);
}

// The checkpoint at the start has one record.
TEST(Damage, AByteOfTheRecordsIsRefusedOrTheirStepsAreMadeAgain) {
  Halves h;
  const Counts n = with_each_byte_turned_over(h, h.log, apart(29), true);
  EXPECT_NEAR(double(n.refused) / n.tried, 1.0 / 7, 0.05);
  EXPECT_EQ(n.refused + n.continued, n.tried);
}

TEST(Damage, RecordsThatAreCutOffAreMadeAgain) {
  Halves h;
  const auto size = fs::file_size(h.log);
  int refused = 0, continued = 0;
  for (std::uintmax_t n = 0; n < size; n += apart(67)) {
    h.again();
    fs::resize_file(h.log, n);
    if (h.resume().empty()) {
      ++continued;
      EXPECT_TRUE(h.has_the_same_bytes()) << n;
    } else {
      ++refused;
    }
  }
  std::printf("  records.bin cut off: %d refused, %d continued to the same bytes\n", refused,
              continued);
  EXPECT_GT(refused, 0);
  EXPECT_GT(continued, 4 * refused);
}

// A second damage after the first: the checkpoint that was returned to is the only one.
TEST(Damage, IsSaidOnce) {
  Halves h;
  write_bytes(h.state, "Porthos\nrubbish");
  EXPECT_EQ(h.resume(3), "");
  EXPECT_EQ(h.said, "the checkpoint " + h.state.string() +
                        " is truncated: it has 15 bytes: the run continues from the checkpoint "
                        "before it, at step 0");
  h.said.clear();
  EXPECT_EQ(h.resume(), "");
  EXPECT_EQ(h.said, "");
  EXPECT_TRUE(h.has_the_same_bytes());
}

/// Everything that a results file says, in one text.
std::string all_of(const fs::path& path) {
  const scene::Hdf5Reader file(path);
  std::string all;
  const auto attributes = [&](const std::string& object) {
    for (const auto& [name, text] : file.texts(object)) all += name + "=" + text + "\n";
    for (const auto& [name, x] : file.numbers(object)) all += name + "=" + std::to_string(x) + "\n";
  };
  attributes("/");
  for (const auto& [name, d] : file.datasets()) {
    all += name + "\n";
    attributes(name);
    if (d.kind == scene::Hdf5Reader::Kind::text) {
      all += file.text(name);
    } else {
      std::vector<double> x(size_t(d.size()));
      file.read(name, x.data());
      all.append(reinterpret_cast<const char*>(x.data()), x.size() * sizeof(double));
    }
  }
  return all;
}

TEST(Damage, AByteOfTheResultsIsRefusedOrChangesNothing) {
  Halves h;
  const fs::path file = h.folder / "whole" / "run.h5";
  const std::string sound = all_of(file);
  int tried = 0, refused = 0, same = 0;
  for (size_t at = 0; at < h.whole.size(); at += apart(53), ++tried) {
    std::string wrong = h.whole;
    wrong[at] = char(wrong[at] ^ (1 << (at % 8)));
    write_bytes(file, wrong);
    std::string now;
    if (const auto text = refusal([&] { now = all_of(file); }); !text.empty()) {
      ++refused;
      EXPECT_TRUE(says(text, "cannot read " + file.string())) << text;
    } else if (now == sound) {
      ++same;
    } else {
      ADD_FAILURE() << "byte " << at << " gives another result";
    }
  }
  std::printf("  run.h5 of %zu bytes: %d turned over, %d refused, %d without meaning\n",
              h.whole.size(), tried, refused, same);
  EXPECT_GT(refused, tried / 2);
}

// Control: without the digest of a record a changed one would be a result. A forged digest is one.
TEST(Damage, AForgedRecordIsAnotherResult) {
  Halves h;
  auto c = scene::read_checkpoint(h.checkpoint);
  const scene::RecordLayout layout(h.c.assembly.model->description(), h.c.scene.extrema);
  std::vector<double> rows;
  scene::RecordReader(h.log, layout).read(rows, 100);
  rows[layout.size() + layout.energy()] += 1;
  {
    scene::RecordLog forged(h.log, layout);
    for (size_t i = 0; i < rows.size(); i += layout.size())
      forged.append(std::span<const double>(rows).subspan(i, layout.size()));
    forged.sync();
    c.log = forged.mark();
  }
  scene::write_checkpoint(h.checkpoint, c);
  EXPECT_EQ(h.resume(), "");
  EXPECT_FALSE(h.has_the_same_bytes());
}

TEST(Damage, AReportOfAnUnfinishedRunShowsTheRecordsBeforeIt) {
  const TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(
      folder / "scene.toml",
      "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[initial]\njoints.elbow = { velocity = 1 "
      "}\n[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\nrecord_every "
      "= 0.01\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  auto options = into(folder / "out");
  options.stop_at = 6;
  scene::run(s, scene::assemble(s), options);
  EXPECT_FALSE(says(report::report_json(folder / "out"), "is damaged at record"));
  const fs::path log = folder / "out" / "checkpoint" / "records.bin";
  std::string bytes = read_bytes(log);
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 4);  // of the fourth of 7 records
  write_bytes(log, bytes);
  EXPECT_TRUE(says(report::report_json(folder / "out"),
                   "is damaged at record 3: the 3 records before it are sound"));
}

}  // namespace
}  // namespace porthos::test::damage_test
