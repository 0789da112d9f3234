#!/usr/bin/env python3
"""Writes small files with the headers of models on staggered or unstructured grids and of
ensembles and forecasts, and compares the program's reports with values computed by numpy from the
same numbers.

    python3 tests/integration/model_files.py --program=build/release/windsplat [NAME...]

Variables, dimensions and attributes follow the models' public documentation. Compared are the axes,
and units, ranges, masks and single values of every field (see real_files.py). Files that cannot be
drawn must be refused with the reason. Exits 1 if anything differs."""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import ensemble_models as ensemble
import joined_models as joined
import lattice_models as lattice
import mesh_models as meshes
import staggered_models as staggered
import unstructured_models as unstructured
from real_files import check_file

READ = {"wrfout_d01.nc": staggered.write_wrf,
        "wrfout_d02_*.nc": staggered.write_wrf_series,
        "roms_his.nc": staggered.write_roms,
        "roms_old.nc": staggered.roms_without_terms,
        "roms_g1.nc": staggered.roms_transform_1,
        "mitgcm.nc": staggered.write_mitgcm,
        "mom6.nc": staggered.write_mom6,
        "sgrid.nc": staggered.write_sgrid,
        "instruments.nc": lattice.write_instruments,
        "auxiliary.nc": lattice.write_auxiliary,
        "section.nc": lattice.write_section,
        "chain.nc": lattice.write_chain,
        "icon_lonlat.nc": lattice.write_icon,
        "cm1.nc": lattice.write_cm1,
        "cosmo.nc": lattice.write_cosmo,
        "palm.nc": lattice.write_palm,
        "um.nc": lattice.write_um,
        "um_levels.nc": lattice.write_um_of_one_dimension,
        "ideal.nc": lattice.write_one_place,
        "{ua,va,wap,hus}_*.nc": joined.write_cmip,
        "ORCA_{grid_T,grid_U,grid_V,grid_W}.nc": joined.write_nemo,
        "ensemble.nc": ensemble.write_members,
        "members.nc?number=7": ensemble.write_members,
        "ens_{ta,ua}_*.nc?realization=2": ensemble.write_members_of_variables,
        "seasonal.nc?forecast_reference_time=30&number=2": ensemble.write_seasonal,
        "cfgrib.nc?time=2020-01-02T00:00:00Z": ensemble.write_cfgrib,
        "spectrum.nc?wavelength=0.55": ensemble.write_spectrum,
        "ugrid_sphere.nc": meshes.write_ugrid,
        "ugrid_plane.nc": meshes.write_ugrid_plane,
        "fvcom_tide.nc": meshes.write_fvcom,
        "mpas_history.nc": meshes.write_mpas,
        "mpas_edges.nc": meshes.write_mpas_edges,
        "icon_atm.nc": meshes.write_icon,
        "{scrip,cam}.nc": meshes.write_cam,
        "{fesom.mesh.diag,uvt.fesom.1958}.nc": meshes.write_fesom}
REFUSED = {"ugrid.nc": unstructured.write_ugrid,
           "fvcom.nc": unstructured.write_fvcom,
           "mpas.nc": unstructured.write_mpas,
           "icon.nc": unstructured.write_icon}
# Parts of the messages.
REASONS = {"ugrid.nc": "fewer than three different corners",
           "fvcom.nc": "no valid node at corner 3",
           "mpas.nc": "unstructured grid",
           "icon.nc": "unstructured grid"}


def check_refusal(program, path, reason):
    done = subprocess.run([program, "inspect", path], capture_output=True, text=True, check=False)
    if done.returncode == 3 and reason in done.stderr:
        return []
    return [f"exit code {done.returncode}, {done.stdout[:200]} {done.stderr[:200]}"]


def main():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--program", default=root / "build/release/windsplat")
    parser.add_argument("--keep", type=Path, help="write the files to this folder and keep them")
    options = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = options.keep or Path(folder)
        for name, write in (READ | REFUSED).items():
            if options.names and name not in options.names:
                continue
            if name in REFUSED:
                write(folder / name)
                faults = check_refusal(options.program, folder / name, REASONS[name])
                compared = 1
            else:
                expected = write(folder / name)
                # Of a mesh, a function of what the program reports: the lattice is its own.
                read = expected if callable(expected) else lambda *_, e=expected: e
                check = check_file(options.program, folder / name, read, only=True)
                compared, faults = check.compared, check.faults
            failed += bool(faults)
            print(f"{name}: {compared} comparisons, {len(faults)} differ")
            for fault in faults[:20]:
                print(f"  {fault}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
