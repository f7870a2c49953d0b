"""Maps what an OAK-D sees: python live_oak.py [FRAMES]. Needs `pip install depthai`, version 3."""

import sys

import depthai as dai

import dynvox

WIDTH, HEIGHT, LEFT, RIGHT = 640, 400, dai.CameraBoardSocket.CAM_B, dai.CameraBoardSocket.CAM_C
frames = int(sys.argv[1]) if len(sys.argv) > 1 else None

with dai.Pipeline() as pipeline:
    # The device rectifies; both pictures of a pair come in one message.
    outputs = [pipeline.create(dai.node.Camera).build(socket).requestOutput((WIDTH, HEIGHT), dai.ImgFrame.Type.GRAY8) for socket in (LEFT, RIGHT)]
    stereo, sync = pipeline.create(dai.node.StereoDepth).build(*outputs), pipeline.create(dai.node.Sync)
    stereo.rectifiedLeft.link(sync.inputs["left"])
    stereo.rectifiedRight.link(sync.inputs["right"])
    queue = sync.out.createOutputQueue()

    # Rectified pictures have the numbers of the right camera; distances of the device are centimetres.
    calibration = pipeline.getDefaultDevice().readCalibration()
    (focal_px, _, center_u_px), (_, _, center_v_px), _ = calibration.getCameraIntrinsics(RIGHT, WIDTH, HEIGHT)
    rig = dynvox.Rig(focal_px, center_u_px, center_v_px, abs(calibration.getBaselineDistance(RIGHT, LEFT, False)) / 100)

    pipeline.start()
    with dynvox.Mapper(rig, planning="100x100x20") as mapper:
        while pipeline.isRunning():
            pair = queue.get()
            time_ns = int(pair["left"].getTimestampDevice().total_seconds() * 1e9)
            report = mapper.step(pair["left"].getCvFrame(), pair["right"].getCvFrame(), time_ns=time_ns)
            print(report["frame"], report["t_world_camera"]["translation_m"], report["severity"])
            if report["frame"] + 1 == frames:
                break
