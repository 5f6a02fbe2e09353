// Keeps traversals in memory between rounds: word k of slot i is states[k * args.count + i], so that
// lanes read and write in sequence.
layout(std430, binding = kBindStates) buffer States { uint states[]; };

uint state_at(uint slot, uint word) { return word * args.count + slot; }

void load_state(uint slot) {
    current = states[state_at(slot, kStateCurrent)];
    uint places = states[state_at(slot, kStatePlaces)];
    triangle = places >> 16u;
    stack_size = places & 0xFFFFu;
    for (uint k = 0u; k < 4u; ++k) answer[k] = states[state_at(slot, kStateAnswer + k)];
    for (uint i = 0u; i < stack_size; ++i) {
        stack[i].x = states[state_at(slot, kStateStack + 2u * i)];
        stack[i].y = states[state_at(slot, kStateStack + 2u * i + 1u)];
    }
}

void save_state(uint slot) {
    states[state_at(slot, kStateCurrent)] = current;
    states[state_at(slot, kStatePlaces)] = stack_size | (triangle << 16u);
    for (uint k = 0u; k < 4u; ++k) states[state_at(slot, kStateAnswer + k)] = answer[k];
    for (uint i = 0u; i < stack_size; ++i) {
        states[state_at(slot, kStateStack + 2u * i)] = stack[i].x;
        states[state_at(slot, kStateStack + 2u * i + 1u)] = stack[i].y;
    }
}
