"""A strict check of a job template against the text of the Open Job Description specification, version 2023-09, without
extensions: https://github.com/OpenJobDescription/openjd-specifications, wiki/2023-09-Template-Schemas.md. Numbers in the
comments are sections of it. Only what a template without job parameters and environments may have is allowed."""

import re
import unicodedata

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}\Z")  # 7.1
REFERENCE = re.compile(r"\{\{(.*?)\}\}", re.DOTALL)        # 7.3


def faults_of(template):
    """Returns the faults of a template, as texts; none if it is valid."""
    check = _Check()
    check.template(template)
    return check.faults


class _Check:
    def __init__(self):
        self.faults = []

    def expect(self, holds, fault):
        if not holds:
            self.faults.append(fault)
        return holds

    def keys(self, where, value, required, optional=()):
        """An object with all required keys, and no unknown ones."""
        if not self.expect(isinstance(value, dict), f"{where}: is no object"):
            return False
        for key in required:
            self.expect(key in value, f"{where}: lacks {key}")
        for key in value:
            self.expect(key in required or key in optional, f"{where}: unknown key {key}")
        return all(key in value for key in required)

    def text(self, where, value, least=1, most=None, controls="", names=None):
        """A string without control characters (9); `names`: it is a format string that may refer to these values."""
        if not self.expect(isinstance(value, str), f"{where}: is no string"):
            return
        self.expect(len(value) >= least, f"{where}: is empty")
        self.expect(most is None or len(value) <= most, f"{where}: has over {most} characters")
        self.expect(all(unicodedata.category(c) != "Cc" or c in controls for c in value), f"{where}: control character")
        if names is not None:
            for reference in REFERENCE.findall(value):
                self.expect(reference.strip() in names, f"{where}: unknown value {reference}")
            self.expect("{{" not in REFERENCE.sub("", value), f"{where}: '{{{{' without end")

    def array(self, where, value, least, most):
        return (self.expect(isinstance(value, list), f"{where}: is no array")
                and self.expect(least <= len(value) <= most, f"{where}: has {len(value)} elements"))

    def template(self, template):  # 1.1
        if not self.keys("template", template, ("specificationVersion", "name", "steps"), ("$schema", "description")):
            return
        self.expect(template["specificationVersion"] == "jobtemplate-2023-09", "specificationVersion")
        self.text("name", template["name"], most=128, names=())  # 1.1.1
        if "description" in template:
            self.text("description", template["description"], most=2048, controls="\n\r\t")  # 7.2
        if not self.array("steps", template["steps"], 1, 10**6):
            return
        for number, step in enumerate(template["steps"]):
            self.step(f"step {number}", step)
        names = [step.get("name") for step in template["steps"] if isinstance(step, dict)]
        self.expect(len(set(names)) == len(names), "two steps of one name")
        for step in template["steps"]:
            self.dependencies(step, names)

    def dependencies(self, step, names):  # 3.2
        if "dependencies" not in step or not self.array("dependencies", step["dependencies"], 1, 10**6):
            return
        for dependency in step["dependencies"]:
            if self.keys("dependency", dependency, ("dependsOn",)):
                on = dependency["dependsOn"]
                self.expect(on in names and on != step.get("name"), f"dependency on {on}")

    def step(self, where, step):  # 3
        if not self.keys(where, step, ("name", "script"), ("description", "parameterSpace", "dependencies")):
            return
        self.text(f"{where} name", step["name"], most=64)  # 3.1
        parameters = self.space(where, step["parameterSpace"]) if "parameterSpace" in step else ()
        self.script(where, step["script"], parameters)

    def space(self, where, space):  # 3.4
        if not self.keys(f"{where} space", space, ("taskParameterDefinitions",), ("combination",)):
            return ()
        definitions = space["taskParameterDefinitions"]
        if not self.array(f"{where} parameters", definitions, 1, 16):
            return ()
        lengths = {}
        for definition in definitions:  # 3.4.1
            if not self.keys(f"{where} parameter", definition, ("name", "type", "range")):
                continue
            name = definition["name"]
            self.expect(isinstance(name, str) and IDENTIFIER.match(name), f"{where}: parameter {name}")
            self.expect(name not in lengths, f"{where}: two parameters {name}")
            self.expect(definition["type"] in ("STRING", "PATH"), f"{where}: type {definition['type']}")
            if self.array(f"{where} range of {name}", definition["range"], 1, 1024):
                for value in definition["range"]:
                    self.text(f"{where} value of {name}", value, most=1024, controls="".join(map(chr, range(32))), names=())  # 3.4.2
                lengths[name] = len(definition["range"])
        if "combination" in space:
            self.combination(where, space["combination"], lengths)
        return tuple(f"Task.{kind}.{name}" for kind in ("Param", "RawParam") for name in lengths)

    def combination(self, where, text, lengths):  # 3.4.3: a product of names and of associations of names
        self.text(f"{where} combination", text, most=1280)
        used = []
        for element in str(text).split("*"):
            names = [name.strip() for name in element.strip().removeprefix("(").removesuffix(")").split(",")]
            self.expect(len(names) == 1 or element.strip().startswith("("), f"{where}: combination {text}")
            self.expect(len({lengths.get(name) for name in names}) == 1, f"{where}: {element}: ranges of different lengths")
            used += names
        self.expect(sorted(used) == sorted(lengths), f"{where}: combination {text}: expected each parameter once")

    def script(self, where, script, parameters):  # 3.5, 5
        if not self.keys(f"{where} script", script, ("actions",)) or not self.keys(f"{where} actions", script["actions"], ("onRun",)):
            return
        action = script["actions"]["onRun"]
        if not self.keys(f"{where} onRun", action, ("command",), ("args", "timeout", "cancelation")):
            return
        names = (*parameters, "Session.WorkingDirectory", "Session.HasPathMappingRules", "Session.PathMappingRulesFile")
        self.text(f"{where} command", action["command"], names=names)  # 5.1
        if self.array(f"{where} args", action.get("args", []), 0, 10**6):
            for argument in action.get("args", []):
                self.text(f"{where} argument", argument, least=0, names=names)  # 5.2
        if "timeout" in action:
            timeout = action["timeout"]
            self.expect(isinstance(timeout, int) and timeout > 0, f"{where}: timeout {timeout}")
        if "cancelation" in action:
            self.cancelation(where, action["cancelation"])

    def cancelation(self, where, method):  # 5.3
        if not self.keys(f"{where} cancelation", method, ("mode",), ("notifyPeriodInSeconds",)):
            return
        self.expect(method["mode"] in ("TERMINATE", "NOTIFY_THEN_TERMINATE"), f"{where}: mode {method['mode']}")
        if "notifyPeriodInSeconds" in method:
            period = method["notifyPeriodInSeconds"]
            self.expect(method["mode"] == "NOTIFY_THEN_TERMINATE", f"{where}: a period with TERMINATE")
            self.expect(isinstance(period, int) and 0 < period <= 600, f"{where}: period {period}")
