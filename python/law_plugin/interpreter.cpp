// The library that the porthos command opens for a scene with a law in Python. It starts an
// interpreter, which runs until the program ends.
#include <Python.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "python/law.h"

namespace {

/// The interpreter that the library was built for, or that of an active virtual environment.
std::string program() {
  namespace fs = std::filesystem;
  const char* const environment = std::getenv("VIRTUAL_ENV");
  std::error_code none;
  if (environment && fs::exists(fs::path(environment) / "bin/python3", none))
    return (fs::path(environment) / "bin/python3").string();
  return PORTHOS_PYTHON_PROGRAM;
}

bool start() {
  PyConfig config;
  PyConfig_InitPythonConfig(&config);
  config.install_signal_handlers = 0;  // Ctrl-C is for the run
  config.buffered_stdio = 0;           // nothing flushes them at the end
  config.parse_argv = 0;
  PyStatus status = PyConfig_SetBytesString(&config, &config.program_name, program().c_str());
  if (PyStatus_Exception(status) == 0) status = Py_InitializeFromConfig(&config);
  PyConfig_Clear(&config);
  if (PyStatus_Exception(status) != 0) return false;
  PyEval_SaveThread();  // any thread may take the GIL
  return true;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const porthos_law* porthos_law_functions() {
  static const bool started = Py_IsInitialized() != 0 || start();
  return started ? &porthos::python::python_laws() : nullptr;
}
