"""A client of darkboxd that knows nothing but its OpenAPI document, and checks every answer against it."""
import http.client
import json
import socket

import jsonschema


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path, timeout=30):
        super().__init__("localhost", timeout=timeout)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)


class Answer:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)


class Api:
    """Operations by their operationId: api.call("getJob", id=3)."""

    def __init__(self, path, document=None):
        self.path = path
        self.document = document or self._fetch_document()
        self.base = self.document["servers"][0]["url"]
        self.operations = {}
        for address, item in self.document["paths"].items():
            for method, operation in item.items():
                self.operations[operation["operationId"]] = (method.upper(), address, operation)
        self.seen = set()  # (operationId, status)

    def _fetch_document(self):
        status, _, body = self._request("GET", "/api/v1/openapi.json")
        assert status == 200, body
        return json.loads(body)

    def _request(self, method, target, body=None, headers=None):
        connection = UnixConnection(self.path)
        connection.request(method, target, body, headers or {})
        response = connection.getresponse()
        result = response.status, response.headers, response.read()
        connection.close()
        return result

    def _resolved(self, thing):
        while "$ref" in thing:
            target = self.document
            for part in thing["$ref"].removeprefix("#/").split("/"):
                target = target[part]
            thing = target
        return thing

    def _check(self, schema, value):
        whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", "components": self.document["components"],
                 **schema}
        jsonschema.Draft202012Validator(whole).validate(value)

    def call(self, operation_id, body=None, headers=None, check_body=True, **parameters):
        method, address, operation = self.operations[operation_id]
        query = []
        for parameter in operation.get("parameters", []):
            parameter = self._resolved(parameter)
            name = parameter["name"]
            if name not in parameters:
                assert not parameter.get("required"), f"{operation_id} needs {name}"
                continue
            value = str(parameters.pop(name))
            if parameter["in"] == "path":
                address = address.replace("{" + name + "}", value)
            else:
                query.append(f"{name}={value}")
        assert not parameters, f"{operation_id} takes no {parameters}"
        headers = dict(headers or {})
        data = None
        if body is not None:
            if check_body:
                self._check(operation["requestBody"]["content"]["application/json"]["schema"], body)
            data = json.dumps(body)
            headers["Content-Type"] = "application/json"
        target = self.base + address + ("?" + "&".join(query) if query else "")
        answer = Answer(*self._request(method, target, data, headers))
        self._check_answer(operation_id, operation, answer)
        return answer

    def _check_answer(self, operation_id, operation, answer):
        responses = operation["responses"]
        assert str(answer.status) in responses, f"{operation_id}: {answer.status} is not in the document: {answer.body}"
        self.seen.add((operation_id, answer.status))
        response = self._resolved(responses[str(answer.status)])
        if answer.status == 304:
            return
        kind = answer.headers["Content-Type"].split(";")[0]
        content = response.get("content", {})
        assert kind in content or "*/*" in content, f"{operation_id}: {kind} is not in the document"
        schema = content.get(kind, {}).get("schema")
        if schema and kind.endswith("json"):
            self._check(schema, answer.json())

    def follow(self, after):
        """Events as they come, for ever."""
        connection = UnixConnection(self.path, timeout=60)
        connection.request("GET", f"{self.base}/events?after={after}")
        for line in connection.getresponse():
            if line.strip():
                yield json.loads(line)
