#!/usr/bin/env python3
"""Renders one VTK configuration along a camera path: a job as JSON on stdin -> frame times as JSON
on stdout, and the first frame as a picture. Run by compare.py; needs python3-vtk9 and a display.

A frame is Render() followed by reading the pixels back, as a server that encodes them must. Only
the camera changes between frames, so VTK may reuse its data."""
import json
import math
import resource
import sys
import time

# The factories behind the abstract classes register themselves on import.
import vtkmodules.vtkInteractionStyle  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
import vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.vtkCommonCore import vtkLookupTable, vtkUnsignedCharArray, vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkFiltersCore import vtkAssignAttribute, vtkElevationFilter, vtkHedgeHog
from vtkmodules.vtkFiltersGeneral import (vtkImageDataToPointSet, vtkMergeVectorComponents,
                                          vtkWarpVector)
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIONetCDF import vtkNetCDFReader
from vtkmodules.vtkRenderingCore import (vtkActor, vtkColorTransferFunction, vtkPolyDataMapper,
                                         vtkRenderer, vtkRenderWindow, vtkVolume,
                                         vtkVolumeProperty, vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

# Control points of viridis, low to high.
VIRIDIS = [(0.267, 0.005, 0.329), (0.231, 0.318, 0.545), (0.129, 0.569, 0.549),
           (0.369, 0.788, 0.384), (0.992, 0.906, 0.145)]


def read(job):
    """The file's samples as one image whose points coincide with windsplat's samples."""
    reader = vtkNetCDFReader()
    reader.SetFileName(job["file"])
    reader.UpdateInformation()
    reader.SetDimensions(job["dimensions"])
    reader.Update()
    image = vtkImageData()
    image.DeepCopy(reader.GetOutput())
    dims = image.GetDimensions()
    spacing = [2 * half / count for half, count in zip(job["half_box"], dims)]
    image.SetSpacing(spacing)
    image.SetOrigin([-half + s / 2 for half, s in zip(job["half_box"], spacing)])
    return image


def volume_of(job, image):
    image.GetPointData().SetActiveScalars(job["scalar"])
    if job["volume"] == "fixed-point":
        mapper = vtkFixedPointVolumeRayCastMapper()
        mapper.SetNumberOfThreads(job["threads"])
    else:
        mapper = vtkmodules.vtkRenderingVolumeOpenGL2.vtkOpenGLGPUVolumeRayCastMapper()
        mapper.SetUseJittering(0)
    # Fixed sample distances: one sample per cell and one ray per pixel, at any speed.
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(min(image.GetSpacing()))
    mapper.SetInputData(image)
    unit = min(image.GetSpacing())
    opacity = vtkPiecewiseFunction()
    # Extinction is linear between the points, but the opacity of one sampling step is not.
    points = job["extinction"]
    for (v0, e0), (v1, e1) in zip(points, points[1:]):
        for n in range(33):
            part = n / 32
            extinction = e0 + (e1 - e0) * part
            opacity.AddPoint(v0 + (v1 - v0) * part, -math.expm1(-extinction * unit))
    white = vtkColorTransferFunction()
    white.AddRGBPoint(0, 1, 1, 1)
    white.AddRGBPoint(1, 1, 1, 1)
    properties = vtkVolumeProperty()
    properties.SetScalarOpacity(opacity)
    properties.SetScalarOpacityUnitDistance(unit)
    properties.SetColor(white)
    properties.SetInterpolationTypeToLinear()
    properties.ShadeOff()
    volume = vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(properties)
    return volume


def combine(image, components):
    """The components as one array of vectors."""
    merge = vtkMergeVectorComponents()
    merge.SetInputData(image)
    merge.SetXArrayName(components[0])
    merge.SetYArrayName(components[1])
    merge.SetZArrayName(components[2])
    merge.SetOutputVectorName("vector")
    merge.SetAttributeTypeToPointData()
    merge.Update()
    return merge.GetOutput()


def lines_of(job, image):
    """One line per sample, centred on it, as long as windsplat's; built once."""
    vectors = combine(image, job["components"])
    points = vtkImageDataToPointSet()
    points.SetInputData(vectors)
    active = vtkAssignAttribute()
    active.SetInputConnection(points.GetOutputPort())
    active.Assign("vector", "VECTORS", "POINT_DATA")
    scale = job["line_length"] / job["top_magnitude"]
    back = vtkWarpVector()
    back.SetInputConnection(active.GetOutputPort())
    back.SetScaleFactor(-scale / 2)
    lines = vtkHedgeHog()
    lines.SetInputConnection(back.GetOutputPort())
    lines.SetScaleFactor(scale)
    height = vtkElevationFilter()
    height.SetInputConnection(lines.GetOutputPort())
    half = job["half_box"][2]
    height.SetLowPoint(0, 0, -half)
    height.SetHighPoint(0, 0, half)
    height.Update()
    ramp = vtkColorTransferFunction()
    for n, color in enumerate(VIRIDIS):
        ramp.AddRGBPoint(n / (len(VIRIDIS) - 1), *color)
    table = vtkLookupTable()
    table.SetNumberOfTableValues(256)
    table.SetTableRange(0, 1)
    for n in range(256):
        table.SetTableValue(n, *ramp.GetColor(n / 255), 1)
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(height.GetOutput())
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().LightingOff()
    actor.GetProperty().SetLineWidth(1)
    actor.GetProperty().SetOpacity(job["opacity"])
    return actor, height.GetOutput().GetNumberOfLines()


def window_of(job, renderer):
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*job["size"])
    window.AddRenderer(renderer)
    if job["opacity"] < 1:
        window.SetAlphaBitPlanes(1)
        renderer.SetUseDepthPeeling(1)
        renderer.SetUseDepthPeelingForVolumes(1)
        renderer.SetMaximumNumberOfPeels(job["peels"])
        renderer.SetOcclusionRatio(0)
    return window


def processor_ms():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return 1e3 * (usage.ru_utime + usage.ru_stime)


def frame(window, renderer, eye, pixels):
    camera = renderer.GetActiveCamera()
    camera.SetPosition(eye)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(0, 0, 1)
    renderer.ResetCameraClippingRange()
    window.Render()
    width, height = window.GetSize()
    window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)


def save(window, path):
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()


def main():
    job = json.load(sys.stdin)
    renderer = vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    image = read(job)
    lines = 0
    if job["lines"]:
        actor, lines = lines_of(job, image)
        renderer.AddActor(actor)
    if job["volume"] is not None:
        renderer.AddVolume(volume_of(job, image))
    window = window_of(job, renderer)
    renderer.GetActiveCamera().SetViewAngle(job["fov_y"])
    pixels = vtkUnsignedCharArray()
    frame(window, renderer, job["eyes"][0], pixels)
    save(window, job["picture"])
    frames = []
    for eye in job["eyes"]:
        cpu, wall = processor_ms(), time.perf_counter()
        frame(window, renderer, eye, pixels)
        frames.append({"wall_ms": 1e3 * (time.perf_counter() - wall),
                       "cpu_ms": processor_ms() - cpu})
    capabilities = window.ReportCapabilities()
    gl = next((line.split(":", 1)[1].strip() for line in capabilities.splitlines()
               if line.startswith("OpenGL renderer string")), "unknown")
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    json.dump({"frames": frames, "peak_bytes": peak, "lines": lines, "gl": gl,
               "version": vtkVersion().GetVTKVersion()}, sys.stdout)


main()
