// XML files of VTK are read in a module of its own, which is loaded when the first one is opened: VTK's libraries would
// take 30 ms of every start of a program that reads none.
#include <dlfcn.h>

#include "deform/errors.h"
#include "io/vtk_file.h"

namespace tetwarp {

namespace {

using Open = VtkFile*(const char*);

Open* load() {
  void* module = ::dlopen(TETWARP_VTK_MODULE, RTLD_NOW | RTLD_LOCAL);  // stays until the program ends
  return module ? reinterpret_cast<Open*>(::dlsym(module, "tetwarp_open_vtk_xml")) : nullptr;
}

}  // namespace

std::unique_ptr<VtkFile> open_vtk_xml(const std::filesystem::path& path) {
  static Open* const open = load();
  if (!open) {
    throw NotCompiled("XML files of VTK need " TETWARP_VTK_MODULE ", which cannot be loaded, " + path.string() +
                      "; put it into lib beside the program's folder, or write a legacy file (.vtk)");
  }
  return std::unique_ptr<VtkFile>(open(path.c_str()));
}

}  // namespace tetwarp
