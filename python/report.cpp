#include "report/report.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/interruptible.h"
#include "report/live_picture.h"
#include "scene/session/export.h"

namespace porthos::python {

namespace py = pybind11;

namespace {

void bind_live_picture(py::module_& m) {
  using py::arg;
  py::class_<report::LivePicture>(
      m, "LivePicture",
      "Pictures of a mechanism in any pose, as the playback of a report.html draws it.")
      .def(py::init([](std::shared_ptr<const mechanics::Mechanism> mechanism,
                       const std::string& page, std::pair<int, int> size, const std::string& camera,
                       const std::string& follow, bool dark) {
             const py::gil_scoped_release released;
             report::FilmOptions o;
             o.width = size.first;
             o.height = size.second;
             o.camera = camera;
             o.ride = follow;
             o.dark = dark;
             return std::make_unique<report::LivePicture>(std::move(mechanism), page, o);
           }),
           arg("mechanism"), arg("page"), py::kw_only(), arg("size") = std::pair{640, 480},
           arg("camera") = "iso", arg("follow") = "place", arg("dark") = false)
      .def(
          "picture",
          [](report::LivePicture& self, py::array_t<double, py::array::c_style> q) {
            std::vector<std::uint8_t> pixels;
            {
              const std::span<const double> all(q.data(), size_t(q.size()));
              const py::gil_scoped_release released;
              pixels = self.picture(all);
            }
            return as_array(std::move(pixels), {self.height(), self.width(), 3});
          },
          arg("q"), "(height, width, 3), red, green and blue in 0 to 255. q: nq coordinates.");
  m.def("model_folders", &report::model_folders, arg("scene"),
        "The folders of a scene's model and of the scene, where its meshes are.");
}

}  // namespace

void bind_report(py::module_& m) {
  using py::arg;
  m.def(
      "export_csv",
      [](const std::string& folder, const std::string& file,
         const std::vector<std::string>& names) { scene::export_csv(folder, file, names); },
      arg("folder"), arg("file"), arg("names") = std::vector<std::string>{},
      "The time series of a finished run as one CSV table: Result.to_csv().");
  m.def(
      "find_template", [] { return report::find_template().string(); },
      "The page of report.html without its data; empty if there is none.");
  m.def(
      "write_report",
      [](const std::string& folder, const std::string& out, const std::string& page,
         const std::vector<std::filesystem::path>& models) {
        const py::gil_scoped_release released;
        return report::write_report(folder, out, page, models);
      },
      arg("folder"), arg("out"), arg("page"), arg("models") = std::vector<std::filesystem::path>{},
      "Fills the template `page` with the results in a folder and writes `out`. models: where the "
      "meshes of the model are. Returns what the playback does not show of them, empty if it shows "
      "all.");
  m.def(
      "write_film",
      [](const std::string& page, const std::string& out, std::pair<int, int> size,
         std::optional<double> from, std::optional<double> to, std::optional<double> rate,
         const std::string& camera, const std::string& follow, bool orbit, bool arrows, bool dark,
         bool trail, const std::vector<std::string>& trail_of, bool text) {
        std::string remark;
        interruptibly([&](const std::atomic<bool>& stop) {
          remark = report::write_film(page, out,
                                      {.width = size.first,
                                       .height = size.second,
                                       .from = from,
                                       .to = to,
                                       .rate = rate,
                                       .camera = camera,
                                       .ride = follow,
                                       .orbit = orbit,
                                       .arrows = arrows,
                                       .dark = dark,
                                       .trail = trail,
                                       .trail_of = trail_of,
                                       .text = text,
                                       .stop = &stop});
        });
        return remark;
      },
      arg("page"), arg("out"), arg("size"), arg("start"), arg("end"), arg("speed"), arg("camera"),
      arg("follow"), arg("orbit"), arg("arrows"), arg("dark"), arg("trail"), arg("trail_of"),
      arg("text"),
      "Writes a film or a picture of the playback of a report.html, or of the results in a folder. "
      "Returns a remark where bodies turn far between two of its records.");
  bind_live_picture(m);
}

}  // namespace porthos::python
