#include "python/law.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace porthos::python {
namespace {

namespace py = pybind11;

/// What is easier said in Python: the import of the file, the checks, the pickle.
constexpr const char* in_python = R"py(
import copy, json, os, pickle, sys, traceback, types
import numpy

modules = {}  # by path and text: a file that has changed is another one


def module_of(path, text):
    if (path, text) not in modules:
        folder = os.path.dirname(os.path.abspath(path))
        if folder not in sys.path:
            sys.path.append(folder)
        stem = os.path.splitext(os.path.basename(path))[0]
        module = types.ModuleType(f"porthos_law_{len(modules)}_{stem}")
        module.__file__ = path
        sys.modules[module.__name__] = module  # where pickle looks for its classes
        exec(compile(text, path, "exec"), module.__dict__)
        modules[path, text] = module
    return modules[path, text]


class Law:
    def __init__(self, law, name, size, arguments="t, q, v"):
        self.law, self.size = law, size
        if not callable(law):
            raise TypeError(f"{name} has no method __call__(self, {arguments})")
        self.stateless = getattr(self.law, "stateless", False) is True
        own = getattr(type(self.law), "__getstate__", None)
        self.own_state = own is not None and own is not getattr(object, "__getstate__", None)
        if not self.stateless and not self.own_state and (
            isinstance(self.law, types.FunctionType) or not hasattr(self.law, "__dict__")
        ):
            raise TypeError(
                f"{name} makes no object whose attributes are its state, expected a class with "
                "attributes, or __getstate__ and __setstate__, or stateless = True"
            )

    def torques(self, t, *measured):
        tau = numpy.asarray(self.law(t, *measured), dtype=float)
        if tau.shape == () and self.size == 1:
            tau = tau.reshape(1)
        if tau.shape != (self.size,):
            raise ValueError(f"the law returned an array of shape {tau.shape}, expected ({self.size},)")
        return numpy.ascontiguousarray(tau)

    def save(self):
        if self.stateless:
            return b""
        state = self.law.__getstate__() if self.own_state else self.law.__dict__
        try:
            return pickle.dumps(state, 5)
        except Exception as why:
            raise TypeError(
                f"the law's state cannot be pickled ({why}), expected such things as globals, or "
                "__getstate__ and __setstate__, or stateless = True"
            ) from None

    def restore(self, saved):
        state = pickle.loads(saved)
        if hasattr(self.law, "__setstate__"):
            self.law.__setstate__(state)
        else:
            self.law.__dict__.clear()
            self.law.__dict__.update(state)


def of_file(joints, settings):
    given = json.loads(settings)
    module, name = module_of(given["file"], given["text"]), given["class"]
    if not hasattr(module, name):
        raise AttributeError(f"{os.path.basename(given['file'])} has no class '{name}'")
    law = getattr(module, name)(joints, *([given["settings"]] if "settings" in given else []))
    return Law(law, name, len(joints))


def copy_of(law):
    try:
        return copy.deepcopy(law)
    except Exception as why:
        raise TypeError(
            f"a run copies {type(law).__name__} and its attributes, its state, and cannot ({why}), expected such things "
            "outside the object, as globals"
        ) from None


class CopyOf(Law):
    "Of an object law(t, x, y)."

    def __init__(self, law, size):
        super().__init__(copy_of(law), type(law).__name__, size, "t, x, y")

    def torques(self, t, q, y, x):
        return super().torques(t, x, y)


def told(error):
    "The error in one line, with the place of the law that it comes from."
    place = [(f.filename, f.lineno) for f in traceback.extract_tb(error.__traceback__)]
    place = [p for p in place if p[0] != "<porthos law>"]
    if isinstance(error, SyntaxError):
        place, error = [(error.filename, error.lineno)], SyntaxError(error.msg)
    laws = [p for p in place if any(p[0] == path for path, text in modules)]
    where = (laws or place)[-1:]
    text = f"{type(error).__name__}: {error}".replace("\n", " ")
    return text + "".join(f" ({os.path.basename(name)}:{line})" for name, line in where)
)py";

/// The module above, made once; it lives as long as the interpreter.
py::handle helper() {
  static PyObject* made = nullptr;
  if (!made) {
    py::dict names;
    names["__builtins__"] = py::module_::import("builtins");
    names["__name__"] = "porthos_law";
    const auto code = py::reinterpret_steal<py::object>(
        Py_CompileString(in_python, "<porthos law>", Py_file_input));
    if (!code) throw py::error_already_set();
    const auto done =
        py::reinterpret_steal<py::object>(PyEval_EvalCode(code.ptr(), names.ptr(), names.ptr()));
    if (!done) throw py::error_already_set();
    made = names.release().ptr();
  }
  return made;
}
py::object helper(const char* name) {
  return py::reinterpret_borrow<py::object>(PyDict_GetItemString(helper().ptr(), name));
}

void put(const std::string& text, char* message) {
  const size_t n = std::min(text.size(), size_t(PORTHOS_LAW_MESSAGE - 1));
  std::memcpy(message, text.data(), n);
  message[n] = '\0';
}
/// Calls f() with the GIL. An exception becomes a message and `failed`.
template <class F, class R>
R with_python(F f, R failed, char* message) {
  const py::gil_scoped_acquire gil;
  try {
    return f();
  } catch (py::error_already_set& e) {
    try {
      if (e.trace()) PyException_SetTraceback(e.value().ptr(), e.trace().ptr());
      put(helper("told")(e.value()).template cast<std::string>(), message);
    } catch (const std::exception&) {  // the helper itself could not be made, as without numpy
      PyErr_Clear();
      put(e.what(), message);
    }
  } catch (const std::exception& e) {
    put(e.what(), message);
  }
  return failed;
}

/// A law over n joints, and its methods looked up once.
struct PythonLawObject {
  py::ssize_t n, inputs;
  py::object torques, save, restore;
};
PythonLawObject& object(void* law) { return *static_cast<PythonLawObject*>(law); }

/// make(): the law, of the helper's class.
template <class Make>
void* create_by(int n, int inputs, char* message, Make make) {
  return with_python(
      [&]() -> void* {
        const py::object law = make();
        return new PythonLawObject{n, inputs, law.attr("torques"), law.attr("save"),
                                   law.attr("restore")};
      },
      static_cast<void*>(nullptr), message);
}
void* create(int n, const char* const* names, int inputs, const char* settings, char* message) {
  return create_by(n, inputs, message, [&] {
    py::list joints;
    for (int k = 0; k < n; ++k) joints.append(names[k]);
    return helper("of_file")(joints, settings);
  });
}
void* create_copy(int n, const char* const*, int inputs, const char* settings, char* message) {
  return create_by(n, inputs, message, [&] {
    const py::handle law = reinterpret_cast<PyObject*>(std::uintptr_t(std::stoull(settings)));
    return helper("CopyOf")(law, n);
  });
}

int torques(void* law, double t, const double* q, const double* v, const double* inputs,
            double* tau, char* message) {
  return with_python(
      [&] {
        auto& own = object(law);
        const py::array_t<double> positions(own.n, q), rates(own.n, v);
        const py::array_t<double> given =
            own.inputs > 0
                ? own.torques(t, positions, rates, py::array_t<double>(own.inputs, inputs))
                : own.torques(t, positions, rates);
        std::copy_n(given.data(), own.n, tau);
        return 0;
      },
      -1, message);
}

int save(void* law, void* bytes, int size, char* message) {
  return with_python(
      [&] {
        const py::bytes saved = object(law).save();
        char* from = nullptr;
        py::ssize_t n = 0;
        if (PyBytes_AsStringAndSize(saved.ptr(), &from, &n) != 0) throw py::error_already_set();
        if (n <= size) std::memcpy(bytes, from, size_t(n));
        return int(n);
      },
      -1, message);
}

int restore(void* law, const void* bytes, int size, char* message) {
  return with_python(
      [&] {
        object(law).restore(py::bytes(static_cast<const char*>(bytes), size_t(size)));
        return 0;
      },
      -1, message);
}

void destroy(void* law) {
  if (!Py_IsInitialized()) return;
  const py::gil_scoped_acquire gil;
  delete static_cast<PythonLawObject*>(law);
}

}  // namespace

const porthos_law& python_laws() {
  static const porthos_law all{PORTHOS_LAW_VERSION, create, torques, save, restore, destroy};
  return all;
}

const porthos_law& python_object_laws() {
  static const porthos_law all{PORTHOS_LAW_VERSION, create_copy, torques, save, restore, destroy};
  return all;
}

}  // namespace porthos::python
