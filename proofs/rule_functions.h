// Functions of common/interop/hit_rule.h as templates over the type of their floats: their text,
// taken from the header by extract.cmake when the proofs are built.
#ifndef PROOFS_RULE_FUNCTIONS_H
#define PROOFS_RULE_FUNCTIONS_H

#include "common/interop/constants.h"

namespace morphray::proofs {

#include "proofs/rule_functions.inc"

}  // namespace morphray::proofs

#endif  // PROOFS_RULE_FUNCTIONS_H
