// The traversal of rays and queries, one a lane: depth first, of a node's children the one with the least
// key next. It can stop after any visit and go on later: a kernel that RESUMES has args.count slots for
// states. A kernel defines kSteps, kStackRoom, kStackSize and the hooks that are declared here, and calls
// begin_traversal() and traverse().
#include "shaders/tree.glsl"

// The state of a traversal, which save_state() keeps.

/// What has been found; the hooks know what it means.
uvec4 answer;
/// The node or leaf to visit next, or kEmptyChild at the end; and the leaf's next triangle.
uint current;
uint triangle;
/// Boxes to visit later, as (child, key). Keys are 0 or more: signed numbers are compared faster.
uint stack_size;
uvec2 stack[kStackSize];

/// The key of `current` while the children of a node are considered.
int current_key;

// Hooks, of which the first two return the steps that they take: at least one for each iteration.

/// Calls consider() for the children of a node that are to be visited.
uint meet_children(uint node);
/// Tests triangles of a leaf from `triangle` on, and sets that to the next one, 0 at the end.
uint test_triangles(uint leaf, uint count);
/// Boxes of larger keys need no longer be visited.
int last_key();

void begin_traversal() {
    current = 0u;
    triangle = 0u;
    stack_size = 0u;
}

bool finished() { return current == kEmptyChild; }

/// Makes a child the next to visit if it is the nearest so far, and pushes the other one.
void consider(uint child, int key) {
    bool is_nearer = key < current_key;
    if (current != kEmptyChild) {
        stack[stack_size] = is_nearer ? uvec2(current, uint(current_key)) : uvec2(child, uint(key));
        stack_size += 1u;
    }
    if (!is_nearer) return;
    current = child;
    current_key = key;
}

/// Pops entries up to one that is to be visited. Returns the number of iterations.
uint pop() {
    uint steps = 0u;
    int last = last_key();
    current = kEmptyChild;
    do {
        bool is_any = stack_size > 0u;
        stack_size -= is_any ? 1u : 0u;
        uvec2 entry = stack[stack_size];
        current = is_any && int(entry.y) <= last ? entry.x : kEmptyChild;
        ++steps;
    } while (current == kEmptyChild && stack_size > 0u);
    return steps;
}

uint visit_node() {
    // A short stack is full: `resume` traces the ray from the root. Only a broken device fills a whole one.
    if (stack_size + kWidth - 1u > kStackRoom) return kSteps;
    uint node = current;
    current = kEmptyChild;
    current_key = 0x7FFFFFFF;
    uint steps = meet_children(node);
    return current == kEmptyChild ? steps + pop() : steps;
}

uint visit_leaf() {
    uint leaf = leaf_of(current);
    uint count = leaf_triangle_count(leaf);
    uint steps = test_triangles(leaf, count);
    return triangle != 0u ? steps : steps + pop();
}

/// Continues until finished() or the steps are used up.
void traverse() {
    uint steps = 0u;
    do {
        while (!is_leaf(current) && steps < kSteps) steps += visit_node();
        if (is_leaf(current) && current != kEmptyChild) steps += visit_leaf();
    } while (current != kEmptyChild && steps < kSteps);
}

#ifdef RESUMES
// Word k of slot i is states[k * args.count + i], so that lanes read and write in sequence.
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
#endif
