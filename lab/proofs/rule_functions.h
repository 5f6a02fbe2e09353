// Functions of common/interop/hit_rule.h as templates over the type of their floats: their text,
// taken from the header by extract.cmake when the proofs are built.
#ifndef PROOFS_RULE_FUNCTIONS_H
#define PROOFS_RULE_FUNCTIONS_H

#include "common/interop/constants.h"

namespace mray::proofs {

#include "lab/proofs/rule_functions.inc"

}  // namespace mray::proofs

#endif  // PROOFS_RULE_FUNCTIONS_H
