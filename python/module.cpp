#include <pybind11/pybind11.h>

#include "phs/error.h"
#include "python/bind.h"
#include "python/law.h"
#include "scene/read/controller.h"

PYBIND11_MODULE(_core, m) {
  namespace py = pybind11;
  using namespace porthos::python;
  m.doc() = "The compiled part of porthos.";
  py::register_exception<porthos::InvalidArgument>(m, "InvalidArgument", PyExc_ValueError).doc() =
      "A user's mistake: the text names what was wrong, its value and what was expected (and "
      "file:line for files).";
  py::register_exception<porthos::IoError>(m, "IoError", PyExc_OSError).doc() =
      "A file that cannot be written: its name and the reason of the operating system.";
  bind_scalars(m);
  bind_system(m);
  bind_user_model(m);
  bind_mechanics(m);
  bind_dynamics(m);
  bind_kinematics(m);
  bind_elements(m);
  bind_network(m);
  bind_integrators(m);
  bind_user_method(m);
  bind_energy_shaping(m);
  bind_scene(m);
  bind_report(m);
  bind_ensembles(m);
  bind_plans(m);
  bind_derivatives(m);
  bind_event_derivatives(m);
  bind_identification(m);
  bind_environment(m);
  bind_outputs(m);
  bind_baseline(m);
  bind_regulation(m);
  bind_mechanism_laws(m);
  bind_matched_formulas(m);
  bind_vsa(m);
  explain_type_errors(m);
  porthos::scene::use_python_laws(python_laws());
}
