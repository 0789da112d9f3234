// Cases of OpenFOAM and EnSight: a folder, or a file that refers to others. They are recognised
// here and read by the program windsplat-vtk (server/vtk_loader); any other program refuses them.
#pragma once

#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

enum class CaseFormat { none, openfoam, ensight };

// The format that the name of the dataset stands for: a folder with system/controlDict, a file
// *.foam or *.OpenFOAM; *.case or *.encas. Reads no file. Cases on hosts are not recognised, except
// by a file name.
CaseFormat case_named(Files& files);

// The format by name, or by the first bytes of the dataset's file.
CaseFormat case_of(Files& files, const Result<std::string>& head);

using CaseOpener = Result<std::unique_ptr<FileSource>> (*)(const std::shared_ptr<Files>& files,
                                                           CaseFormat format);
// Sets what reads cases in this process; call it before the first dataset is opened.
void set_case_opener(CaseOpener opener);

// Errors: those of the opener; bad_data, with advice, if there is none.
Result<std::unique_ptr<FileSource>> open_case(const std::shared_ptr<Files>& files,
                                              CaseFormat format);

}  // namespace windsplat::data
