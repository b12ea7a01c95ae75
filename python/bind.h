#pragma once
#include <pybind11/pybind11.h>

#include <memory>

#include "mechanics/mechanical_model.h"

/// One function per source file; module.cpp calls them in this order.
namespace porthos::python {

using MechanicalModelClass = pybind11::class_<mechanics::MechanicalModel, phs::Model,
                                              std::shared_ptr<mechanics::MechanicalModel>>;

void bind_scalars(pybind11::module_& m);
void bind_system(pybind11::module_& m);
void bind_user_model(pybind11::module_& m);
void bind_user_method(pybind11::module_& m);
void bind_mechanics(pybind11::module_& m);
void bind_dynamics(pybind11::module_& m);
void bind_kinematics(pybind11::module_& m);
void bind_elements(pybind11::module_& m);
void bind_network(pybind11::module_& m);
void bind_integrators(pybind11::module_& m);
void bind_energy_shaping(pybind11::module_& m);
void bind_regulation(pybind11::module_& m);
void bind_mechanism_laws(pybind11::module_& m);
void bind_matched_formulas(pybind11::module_& m);
void bind_vsa(pybind11::module_& m);
void bind_scene(pybind11::module_& m);
void bind_report(pybind11::module_& m);
void bind_ensembles(pybind11::module_& m);
void bind_plans(pybind11::module_& m);
void bind_derivatives(pybind11::module_& m);
void bind_event_derivatives(pybind11::module_& m);
void bind_identification(pybind11::module_& m);
void bind_environment(pybind11::module_& m);
void bind_outputs(pybind11::module_& m);
void bind_baseline(pybind11::module_& m);

/// Errors of type in all functions of the module, bound before, get one sentence.
void explain_type_errors(pybind11::module_& m);

/// Loops and couplings, and their part of MechanicalModel, called by bind_mechanics.
void bind_constraints(pybind11::module_& m);
void bind_model_constraints(MechanicalModelClass& model);

/// The file of a run, and what its plots show, called by bind_scene.
void bind_run_file(pybind11::module_& m);
void bind_motion(pybind11::module_& m);

/// Into the submodule energy_shaping, called by bind_energy_shaping.
void bind_designs(pybind11::module_& m);

}  // namespace porthos::python
