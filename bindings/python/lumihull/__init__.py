"""Lumihull: photographs of an object in; silhouettes, a mesh and new views out.

>>> import lumihull
>>> capture = lumihull.Capture.open("my_object")
>>> capture.run()                                    # calibrate, key, hull, texture, evaluate, report
>>> renderer = lumihull.Renderer(capture)
>>> rgba = renderer.render(capture.view(0)).rgba     # (height, width, 4) uint8

Conventions: camera x right, y down, z forward; the centre of the first pixel is (0.5, 0.5); pictures are sRGB. Long
calls release the GIL, take `progress=` (called with a Progress) and stop at Ctrl-C. What goes wrong is a lumihull.Error.
"""

from ._lumihull import NO_HIT as NO_HIT
from ._lumihull import Board as Board
from ._lumihull import BoardTarget as BoardTarget
from ._lumihull import Camera as Camera
from ._lumihull import Capture as Capture
from ._lumihull import Clearance as Clearance
from ._lumihull import ColorKey as ColorKey
from ._lumihull import Crossing as Crossing
from ._lumihull import DecodedTarget as DecodedTarget
from ._lumihull import Detection as Detection
from ._lumihull import Detections as Detections
from ._lumihull import Error as Error
from ._lumihull import Hanging as Hanging
from ._lumihull import Image as Image
from ._lumihull import InkSamples as InkSamples
from ._lumihull import KeepOut as KeepOut
from ._lumihull import LensCalibration as LensCalibration
from ._lumihull import Mechanism as Mechanism
from ._lumihull import MechanismCalibration as MechanismCalibration
from ._lumihull import Mesh as Mesh
from ._lumihull import MeshCheck as MeshCheck
from ._lumihull import Optics as Optics
from ._lumihull import Plan as Plan
from ._lumihull import PointGrid as PointGrid
from ._lumihull import Pose as Pose
from ._lumihull import Progress as Progress
from ._lumihull import RayScene as RayScene
from ._lumihull import RefusedTarget as RefusedTarget
from ._lumihull import Renderer as Renderer
from ._lumihull import Rendering as Rendering
from ._lumihull import Resection as Resection
from ._lumihull import Sensitivity as Sensitivity
from ._lumihull import Session as Session
from ._lumihull import StageResult as StageResult
from ._lumihull import Stop as Stop
from ._lumihull import TargetDesign as TargetDesign
from ._lumihull import TargetDetector as TargetDetector
from ._lumihull import TargetFamily as TargetFamily
from ._lumihull import TargetModel as TargetModel
from ._lumihull import TargetSet as TargetSet
from ._lumihull import Tensions as Tensions
from ._lumihull import View as View
from ._lumihull import __version__ as __version__
from ._lumihull import calibrate_lens as calibrate_lens
from ._lumihull import calibrate_mechanism as calibrate_mechanism
from ._lumihull import carve as carve
from ._lumihull import export_colmap as export_colmap
from ._lumihull import export_nerf as export_nerf
from ._lumihull import find_point_grid as find_point_grid
from ._lumihull import import_colmap as import_colmap
from ._lumihull import import_enclosure as import_enclosure
from ._lumihull import import_masks as import_masks
from ._lumihull import import_middlebury as import_middlebury
from ._lumihull import import_nerf as import_nerf
from ._lumihull import import_photos as import_photos
from ._lumihull import import_projections as import_projections
from ._lumihull import land_card as land_card
from ._lumihull import plan_hemisphere as plan_hemisphere
from ._lumihull import pose_spread as pose_spread
from ._lumihull import psnr as psnr
from ._lumihull import read_image as read_image
from ._lumihull import read_mesh as read_mesh
from ._lumihull import repeatability as repeatability
from ._lumihull import resect as resect
from ._lumihull import silhouette_iou as silhouette_iou
from ._lumihull import ssim as ssim
from ._lumihull import stability as stability
from ._lumihull import stage_names as stage_names
from ._lumihull import stage_options as stage_options
from ._lumihull import standing_object as standing_object
from ._lumihull import write_grid_sheet as write_grid_sheet
from ._lumihull import write_jpeg as write_jpeg
from ._lumihull import write_mesh as write_mesh
from ._lumihull import write_png as write_png
from ._lumihull import write_target_sheets as write_target_sheets
