#pragma once
#include "energy_shaping/porthos_law.h"

namespace porthos::python {

/// Control laws in Python: a class in a file. Settings: JSON with "file", the path of the file, for
/// messages; "text", what it holds; "class"; and "settings", if the class gets any. The interpreter
/// must have been started; the functions take the GIL.
const porthos_law& python_laws();

/// Laws that are copies of an object: law(t, x, y), x the inputs and y the rates of porthos_law.
/// Settings: the address of the object, which must live as long as laws are made of it.
const porthos_law& python_object_laws();

}  // namespace porthos::python
