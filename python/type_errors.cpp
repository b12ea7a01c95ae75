// A wrong argument gets one sentence, in place of pybind11's list of signatures.
#include <pybind11/pybind11.h>

#include <cstdlib>
#include <cstring>

#include "python/bind.h"

namespace porthos::python {
namespace {

namespace py = pybind11;
using py::detail::function_record;

/// What pybind11 calls for each bound function; the same for all of them.
PyCFunctionWithKeywords dispatcher = nullptr;

function_record* record_of(PyObject* capsule) {
  const char* name = py::detail::get_function_record_capsule_name();
  if (!capsule || !PyCapsule_IsValid(capsule, name)) return nullptr;
  return static_cast<function_record*>(PyCapsule_GetPointer(capsule, name));
}

/// The function in Python that finds the sentence: porthos/arguments.py.
py::str sentence(const char* name, const py::object& text, PyObject* arguments,
                 PyObject* keywords) {
  return py::module_::import("porthos.arguments")
      .attr("sentence")(name, text, py::handle(arguments),
                        keywords ? py::reinterpret_borrow<py::object>(keywords) : py::dict());
}

PyObject* call(PyObject* self, PyObject* arguments, PyObject* keywords) {
  PyObject* result = dispatcher(self, arguments, keywords);
  if (result || !PyErr_ExceptionMatches(PyExc_TypeError)) return result;
  py::error_already_set error;  // takes the error
  const function_record* record = record_of(self);
  const std::string start = record ? std::string(record->name) + "(): incompatible " : "";
  try {
    const py::str text(error.value());
    if (!record || std::string(text).rfind(start, 0) != 0) throw std::exception();
    const py::str told = sentence(record->name, text, arguments, keywords);
    PyErr_SetObject(PyExc_TypeError, told.ptr());
  } catch (const std::exception&) {
    error.restore();
  }
  return nullptr;
}

void explain(PyObject* function, const std::string& property = "") {
  if (function && PyInstanceMethod_Check(function))
    function = PyInstanceMethod_GET_FUNCTION(function);
  if (!function || !PyCFunction_Check(function)) return;
  function_record* record = record_of(PyCFunction_GET_SELF(function));
  if (!record) return;
  PyMethodDef* method = reinterpret_cast<PyCFunctionObject*>(function)->m_ml;
  const auto called =
      reinterpret_cast<PyCFunctionWithKeywords>(reinterpret_cast<void (*)()>(method->ml_meth));
  if (called != call) {
    dispatcher = called;
    method->ml_meth = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&call));
  }
  // pybind11 names neither the function that sets a property nor the one that gets it. It frees
  // the name with free().
  if (property.empty() || *record->name) return;
  std::free(record->name);
  record->name = strdup(property.c_str());
}

void explain_members(py::handle scope) {
  for (const auto& [key, member] : py::dict(scope.attr("__dict__"))) {
    const std::string name = py::str(key);
    if (py::isinstance<py::module_>(member)) {
      explain_members(member);
    } else if (PyType_Check(member.ptr())) {
      if (py::str(member.attr("__module__")).cast<std::string>().rfind("porthos._core", 0) == 0)
        explain_members(member);
    } else if (PyObject_TypeCheck(member.ptr(), &PyProperty_Type)) {
      explain(member.attr("fget").ptr(), name);
      explain(member.attr("fset").ptr(), name);
    } else if (py::isinstance<py::staticmethod>(member)) {
      explain(member.attr("__func__").ptr());
    } else {
      explain(member.ptr());
    }
  }
}

}  // namespace

void explain_type_errors(py::module_& m) { explain_members(m); }

}  // namespace porthos::python
