"""The API's document is true: it is valid, names the routes there are, and every answer fits it. A capture, its
processing, and its files are driven by a client that knows the document alone.

usage: openapi_test.py DARKBOXD
"""
import pathlib
import subprocess
import sys
import tempfile
import time

try:
    import jsonschema
except ImportError:
    print("python3-jsonschema is not installed: skipped")
    sys.exit(77)

from api_client import Api

RIG = pathlib.Path(__file__).resolve().parents[3] / "rig/description/examples/simulated-12-lamps.toml"
METHODS = {"get", "put", "post", "delete", "options", "head", "patch", "trace"}


def check_document(document):
    """What OpenAPI 3.1 wants of the parts used here; its schemas against the JSON Schema they are written in."""
    assert document["openapi"].startswith("3.1."), document["openapi"]
    assert document["info"]["title"] and document["info"]["version"]
    ids = []
    for address, item in document["paths"].items():
        assert address.startswith("/") and set(item) <= METHODS, address
        for operation in item.values():
            ids.append(operation["operationId"])
            assert operation["responses"], address
            declared = {resolve(document, p)["name"] for p in operation.get("parameters", [])
                        if resolve(document, p)["in"] == "path"}
            assert declared == {part[1:-1] for part in address.split("/") if part.startswith("{")}, address
            for response in operation["responses"].values():
                assert resolve(document, response)["description"], address
    assert len(set(ids)) == len(ids), "operationIds repeat"
    for name, schema in document["components"]["schemas"].items():
        jsonschema.Draft202012Validator.check_schema(schema)
        assert name


def resolve(document, thing):
    while "$ref" in thing:
        target = document
        for part in thing["$ref"].removeprefix("#/").split("/"):
            target = target[part]
        thing = target
    return thing


def end_of(api, job):
    for event in api.follow(job["event"]):
        if event.get("job") == job["id"] and event["event"] in ("done", "cancelled", "failed"):
            return event
    raise AssertionError("the events ended before the job")


def session_exposure(api, name):
    return api.call("getSession", name=name).json()["frame_list"][0]["exposure_s"]


def drive_a_capture(api):
    status = api.call("getStatus").json()
    while status["state"] == "Offline":
        time.sleep(0.05)
        status = api.call("getStatus").json()
    lamps = [lamp["name"] for lamp in api.call("listLamps").json()["lamps"]]
    job = api.call("startCapture", {"object": "a vase", "lamps": lamps, "name": "vase", "inventory": "1907.12",
                                    "dublin_core": {"title": "Vase: Ø", "creator": ["A", "B"]}}).json()
    refused = api.call("startCapture", {"object": "another"})
    assert refused.status == 409 and "Busy" in refused.json()["detail"], refused.body
    previews = 0
    while api.call("getJob", id=job["id"]).json()["state"] == "running":
        preview = api.call("getPreview")
        previews += preview.status == 200
        assert preview.status == 404 or preview.body[:3] == b"\xff\xd8\xff"
    done = end_of(api, job)
    assert done["event"] == "done" and done["frames"] == len(lamps) + 2, done
    assert previews > 0, "no preview during the whole capture"

    job = api.call("startCapture", {"retake": "vase", "lamps": lamps[:1], "name": "vase-again"}).json()
    done = end_of(api, job)
    assert done["event"] == "done" and done["frames"] == len(lamps) + 4, done
    assert api.call("getSession", name="vase-again").json()["retakes"] == "vase"
    assert api.call("startCapture", {"retake": "none", "lamps": lamps[:1]}).status == 404
    job = api.call("startCapture", {"exposure": "auto", "lamps": lamps[:3], "name": "metered"}).json()
    assert end_of(api, job)["event"] == "done"
    assert api.call("getSession", name="metered").json()["frame_list"][0]["exposure_s"] != session_exposure(api, "vase")

    log = api.call("getJobLog", id=job["id"])
    assert b"done" in log.body
    session = api.call("getSession", name="vase").json()
    assert session["state"] == "sealed" and len(session["frame_list"]) == len(lamps) + 2
    assert session["inventory"] == "1907.12", session
    assert session["dublin_core"] == {"title": ["Vase: Ø"], "creator": ["A", "B"]}, session
    assert {frame["lamp"] for frame in session["frame_list"] if frame["kind"] == "lit"} == set(lamps)
    return session


def look_into_files(api, session):
    files = {f["path"]: f for f in api.call("listFiles", name="vase").json()["files"]}
    path = "data/" + session["frame_list"][0]["file"]
    whole = api.call("getFile", name="vase", path=path)
    assert len(whole.body) == files[path]["bytes"]
    part = api.call("getFile", headers={"Range": "bytes=8-15"}, name="vase", path=path)
    assert part.status == 206 and part.body == whole.body[8:16]
    assert api.call("getFile", headers={"If-None-Match": whole.headers["ETag"]}, name="vase", path=path).status == 304
    assert api.call("getFile", headers={"Range": f"bytes={len(whole.body)}-"}, name="vase", path=path).status == 416
    assert api.call("getFile", name="vase", path="absent").status == 404


def work_the_queue(api):
    recalibration = api.call("enqueueJob", {"kind": "recalibrate"}).json()
    later = api.call("enqueueJob", {"kind": "capture", "object": "never", "name": "never"}).json()
    assert api.call("cancelJob", id=later["id"]).status == 202
    done = end_of(api, recalibration)
    assert done["event"] == "done", done
    calibrated = end_of(api, {"id": done["next"], "event": recalibration["event"]})
    assert calibrated["event"] == "done" and calibrated["result"]["lights"], calibrated
    listed = api.call("listCalibrations").json()["calibrations"]
    assert [c["session"] for c in listed] == [done["session"]], listed
    job = api.call("enqueueJob", {"kind": "export", "session": done["session"], "format": "lp"}).json()
    assert end_of(api, job)["event"] == "done"
    assert b"lamp" in api.call("getFile", name=done["session"], path="exports/lights.lp").body
    assert api.call("enqueueJob", {"kind": "process", "session": "absent"}).status == 404
    pruned = end_of(api, api.call("enqueueJob", {"kind": "prune", "dry_run": True}).json())
    assert pruned["event"] == "done" and pruned["result"]["kept"] == {"younger than 30 days": 4}, pruned


def tell_doses(api, sessions):
    assert api.call("listDoses").json() == {"limits": {}, "objects": []}
    light = api.call("lightLamp", {"lamp": "lamp-01", "seconds": 0.5, "object": "vase"}).json()
    told = next(e for e in api.follow(light["event"]) if e["event"] == "light")
    assert told["lit"] is True, told
    assert api.call("lightLamp", {"lamp": "lamp-99"}).status == 400
    assert api.call("listDoses").json()["objects"] == [], "these lamps do not say how bright they are"
    line = '{"object":"vase","lux_s":12.5,"uv_j_per_m2":0,"ir_j_per_m2":0.25}\n'
    (sessions / ".darkbox" / "dose.jsonl").write_text(2 * line)
    assert api.call("listDoses").json()["objects"] == [
        {"object": "vase", "lux_s": 25, "uv_j_per_m2": 0, "ir_j_per_m2": 0.5}]
    (sessions / ".darkbox" / "dose.jsonl").write_text("{}\n")
    assert api.call("listDoses").status == 400


def make_mistakes(api):
    assert api.call("enqueueJob", {"kind": "bake"}, check_body=False).status == 400
    assert api.call("enqueueJob", {"kind": "export", "session": "vase"}, check_body=False).status == 400
    assert api.call("startCapture", {"objekt": "x"}, check_body=False).status == 400
    assert api.call("startCapture", {"name": "vase"}).status == 400
    assert api.call("startCapture", {"dublin_core": {"titel": "x"}}, check_body=False).status == 400
    assert api.call("startCapture", {"dublin_core": {"title": 1}}, check_body=False).status == 400
    assert api.call("enqueueJob", {"kind": "prune", "session": "vase"}, check_body=False).status == 400
    assert api.call("startCapture", {"resume": "absent"}).status == 404
    assert api.call("getJob", id=999).status == 404
    assert api.call("getSession", name="absent").status == 404
    assert api.call("listSessions", limit=0).status == 400
    page = api.call("listSessions", limit=1).json()
    assert len(page["sessions"]) == 1 and page["next"] == page["sessions"][0]["name"]
    found = api.call("listSessions", find="VASE%201907").json()
    assert found["total"] == 2 and {s["name"] for s in found["sessions"]} == {"vase", "vase-again"}, found
    assert api.call("listSessions", find="vase%201908").json()["sessions"] == []
    assert api.call("listSessions", find="x" * 201).status == 400
    assert "next" not in api.call("listSessions", after=page["next"], limit=3).json()
    assert len(api.call("listJobs", limit=2).json()["jobs"]) == 2
    assert api.call("rebuildCatalog").json()["sessions"] == 4
    assert api.call("darkenLamps").status == 202
    api.call("getOpenApi")


def main():
    daemon = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        path = str(pathlib.Path(folder) / "d.sock")
        rig = pathlib.Path(folder) / "rig.toml"
        rig.write_text(RIG.read_text() + "\n[retention]\nkeep_days = 30\n")
        process = subprocess.Popen([daemon, "--config", str(rig), "--socket", path, "--sessions",
                                    str(pathlib.Path(folder) / "sessions")], stderr=subprocess.PIPE)
        try:
            while not pathlib.Path(path).exists():
                assert process.poll() is None, process.stderr.read()
                time.sleep(0.02)
            api = Api(path)
            check_document(api.document)
            look_into_files(api, drive_a_capture(api))
            work_the_queue(api)
            tell_doses(api, pathlib.Path(folder) / "sessions")
            make_mistakes(api)
        finally:
            process.terminate()
            process.wait(20)
        unused = set(api.operations) - {operation for operation, _ in api.seen} - {"followEvents"}
        assert not unused, f"never called: {unused}"
        print(f"{len(api.operations)} operations, {len(api.seen)} kinds of answer, all as the document says")


if __name__ == "__main__":
    main()
