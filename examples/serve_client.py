"""Have the server plan a grasp in a depth image, and compute where to place the part.

python -m mskgrasp.serve --port 8093
python examples/serve_client.py [http://127.0.0.1:8093]
"""

import io
import json
import sys
import urllib.request

import numpy as np

SERVER = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8093"


def post(path, body, content_type):  # with a token, add the header "Authorization": f"Bearer {token}"
    request = urllib.request.Request(SERVER + path, body, {"Content-Type": content_type})
    with urllib.request.urlopen(request, timeout=60) as answer:  # what is wrong is raised as HTTPError
        return json.load(answer)


depth = np.full((160, 160), 0.8, np.float32)  # a table 0.8 m below the camera, and a block of 60 x 30 x 40 mm
depth[70:84, 66:94] = 0.76
frame = io.BytesIO()
np.savez_compressed(
    frame,
    depth=depth,
    intrinsics=[[365.0, 0.0, 79.5], [0.0, 365.0, 79.5], [0.0, 0.0, 1.0]],
    T_base_camera=[0.5, 0.0, 0.8, 0.0, 1.0, 0.0, 0.0],  # x y z qw qx qy qz: it looks straight down
)
plan = post("/plan", frame.getvalue(), "application/x-npz")
print(f"grasp {np.round(plan['grasp'], 3)}, quality {plan['quality']:.2f}")
print(f"shift {np.round(plan['displacement'], 4)} +- {np.round(plan['displacement_std'], 4)} m, rad")
print(f"{len(plan['alternatives'])} alternatives")

asked = {"grasp": plan["grasp"], "displacement": plan["displacement"]}
asked |= {"centre_base": plan["part"]["centre_base"], "target": {"x": 0.45, "y": 0.1, "theta": 0.0}}
placed = post("/place", json.dumps(asked).encode(), "application/json")
print(f"place with the hand at {np.round(placed['hand'], 3)}")
