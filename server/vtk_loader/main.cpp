// windsplat-vtk: the loader of cases of OpenFOAM and EnSight, which the readers of VTK read. The
// daemon starts it in place of `windsplat load`; it is the same loader, in the same sandbox.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "server/data/loader/loader.hpp"
#include "server/data/open/cases.hpp"
#include "server/vtk_loader/source.hpp"

int main(int argc, char** argv) {
  if (argc != 2 || std::string_view(argv[1]) != "load") {
    std::fputs(
        "windsplat-vtk is internal: windsplat starts it to read cases of OpenFOAM and "
        "EnSight\n",
        stderr);
    return 2;
  }
  // A loader cannot start threads. (vtkSMPTools.h would need the headers of TBB.)
  ::setenv("VTK_SMP_BACKEND_IN_USE", "Sequential", 1);  // NOLINT(concurrency-mt-unsafe): one thread
  windsplat::data::set_case_opener(windsplat::vtk_loader::open);
  return windsplat::data::loader::run();
}
