// A wrong argument gets one sentence, in place of pybind11's list of signatures.
#include <pybind11/pybind11.h>

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

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

/// The types of the arguments in "(a: module.Class, *, b: List[int] = [1]) -> int", up to **kwargs.
std::vector<std::string> types_of(const std::string& signature) {
  std::vector<std::string> types;
  int depth = 0;
  std::string part;
  const auto take = [&] {
    const auto colon = part.find(": ");
    if (colon != std::string::npos) types.push_back(part.substr(colon + 2));
    part.clear();
  };
  for (const char c : signature) {
    if (c == ')' && depth == 1) break;
    if (std::strchr("([{<", c) && depth++ == 0) continue;
    if (std::strchr(")]}>", c)) --depth;
    if (c == ',' && depth == 1) {
      take();
    } else {
      part += c;
    }
  }
  take();
  return types;
}

/// pybind11 makes a null pointer of None for every argument of a class. Here it is refused, unless
/// it is the default.
void refuse_none(function_record& record) {
  const auto types = types_of(record.signature);
  if (record.args.empty())
    for (size_t i = 0; i < size_t(record.nargs) && i < types.size(); ++i)
      record.args.emplace_back(nullptr, nullptr, py::handle(),
                               !record.is_new_style_constructor || i > 0, true);
  for (size_t i = 0; i < record.args.size() && i < types.size(); ++i)
    if (types[i].rfind("porthos._core.", 0) == 0 && !types[i].ends_with("= None"))
      record.args[i].none = false;
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
  for (function_record* r = record; r; r = r->next) refuse_none(*r);
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
