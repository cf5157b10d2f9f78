# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Whether JSON files meet a schema: check_scenario.py SCHEMA good|bad FILE... Exit status 0: all of them do, or none does."""
import json
import sys

import jsonschema

with open(sys.argv[1], encoding="utf-8") as file:
    schema = json.load(file)
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
wrong = 0
for path in sys.argv[3:]:
    with open(path, encoding="utf-8") as file:
        text = file.read()
    errors = list(validator.iter_errors(json.loads(text)))
    if bool(errors) != (sys.argv[2] == "bad"):
        wrong += 1
        print(path, errors[0].message if errors else "meets the schema: " + text)
sys.exit(wrong != 0)
