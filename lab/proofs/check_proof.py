"""check_proof.py GAPPA CONSTANTS FILE.g: whether Gappa proves every lemma of the file. CONSTANTS is the
program of constants.cpp.
check_proof.py GAPPA CONSTANTS FILE.g NAME FACTOR: whether it no longer does once the constant NAME is
FACTOR times as large. FACTOR is a number or a fraction such as 16/17.
"""
import fractions
import re
import subprocess
import sys


def read_constants(program):
    lines = subprocess.run([program], check=True, capture_output=True, text=True).stdout.splitlines()
    return dict(line.split() for line in lines)


def lemma_of_identity(text):
    """The lemma that each polynomial of an identity is 0, with that as its rewriting rule, which Gappa
    checks by algebra."""
    parts = [part.strip() for part in text.split(";") if part.strip()]
    definitions = [part + ";\n" for part in parts if "=" in part]
    polynomials = [part for part in parts if "=" not in part]
    goals = " /\\ ".join(f"{one} in [0, 0]" for one in polynomials)
    rules = [one + " -> 0;\n" for one in polynomials]
    return "".join(definitions) + "{ " + goals + " }\n" + "".join(rules)


def lemma_of(text):
    """Gappa's own language has neither powers nor calls."""
    text = re.sub(r"rounded\((.*?)\)",
                  lambda call: " /\\ ".join(f"|{one}| <= @kRounding@" for one in call[1].split(", ")), text)
    text = re.sub(r"\b(\w+)\^(\d)", lambda power: "(" + " * ".join([power[1]] * int(power[2])) + ")", text)
    return "e = @kRounding@; up = 1 + e; down = 1 - e; rcp_error = @kRcpUlp@ * 0x1p-23;\n" + text


def read_lemmas(path, constants):
    """The titles and texts of a file's lemmas. Gappa's own uses of @ (@FIX, @FLT) stay."""
    with open(path, encoding="utf-8") as file:
        pieces = re.split(r"^## (lemma|identity): (.*)\n", file.read(), flags=re.MULTILINE)
    lemmas = []
    for kind, title, text in zip(pieces[1::3], pieces[2::3], pieces[3::3]):
        text = re.sub("#.*", "", text)
        text = lemma_of_identity(text) if kind == "identity" else lemma_of(text)
        lemmas.append((title, re.sub("@(k[A-Za-z0-9]+)@", lambda name: constants[name[1]], text)))
    if not lemmas:
        sys.exit(f"{path} has no line \"## lemma: ...\"")
    return lemmas


def is_proved(gappa, title, text):
    """Gappa's warnings count as errors: one of them tells that a rewriting rule is wrong."""
    run = subprocess.run([gappa], input=text, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                         timeout=30, check=False)
    said = run.stdout
    # The second is what a false inequality between constants gives.
    is_refusal = ("some properties were not satisfied" in said or "no contradiction was found" in said)
    if "Warning" in said or "syntax" in said or (run.returncode != 0 and not is_refusal):
        sys.exit(f"{title}:\n{said}")
    if run.returncode != 0:
        print(f"not proved: {title}\n{said}")
    return run.returncode == 0


def main(gappa, program, path, changed=None, factor="1"):
    constants = read_constants(program)
    if changed is not None:
        value = float.fromhex(constants[changed]) * float(fractions.Fraction(factor))
        constants[changed] = value.hex()
    lemmas = read_lemmas(path, constants)
    proved = sum(is_proved(gappa, title, text) for title, text in lemmas)
    print(f"{proved} of {len(lemmas)} lemmas proved")
    return 0 if (proved == len(lemmas)) == (changed is None) else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
