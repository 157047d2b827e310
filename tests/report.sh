#!/bin/bash
# Checks that the measured parts of the documents are what tools/report makes of docs/measurements. If a report is missing,
# tools/report must report it and leave its part as it is.
. "$(dirname "$0")/support.bash"

command -v python3 >/dev/null || skip_all "there is no python3"

document=docs/measurements/README.md
cp -r --parents docs/measurements "$scratch"
tools/report "$scratch/$document" 2>"$scratch/messages"
check "exit status" [ $? = 0 ]
check "the document has the measured values" diff $document "$scratch/$document"
for measured in $(sed -n 's/^<!-- measured: [a-z]* \(.*\) -->$/\1/p' $document); do
    [ -f "docs/measurements/$measured" ] || check "$measured is missing, which is reported" grep -q "no .*$measured" "$scratch/messages"
done

check "the document shows what is simulated" tools/measure/scaling --check --ranks 10,100

# Changed figures are written, as they would be by a new measurement.
sed -i 's/"median": [0-9.e+-]*/"median": 12345.678/' "$scratch/docs/measurements/accuracy.json"
check "a new measurement" tools/report "$scratch/$document"
check "its times are in the document" grep -q '| 12346 (' "$scratch/$document"

printf '%s\n' before '<!-- measured: verify none.json -->' within '<!-- end of measured -->' after >"$scratch/absent.md"
cp "$scratch/absent.md" "$scratch/before.md"
check "a report that is not there" tools/report "$scratch/absent.md"
check "the part of a report that is not there" cmp "$scratch/absent.md" "$scratch/before.md"
printf 'nothing\n' >"$scratch/unmarked.md"
tools/report "$scratch/unmarked.md" 2>/dev/null
check "a document without a measured part" [ $? = 1 ]
finish
