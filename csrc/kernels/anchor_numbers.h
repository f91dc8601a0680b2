// Numbers of anchors (anchors.h), that bounds know too.
#ifndef ANCHOR_NUMBERS_H
#define ANCHOR_NUMBERS_H

#define ANCHOR_ROOTS 1023.0    // steps of the root of 1 - alpha in a key
#define ANCHOR_IMPORTANCE 63.0 // its greatest
#define ANCHOR_OCTAVES 12.0    // that importance tells apart
#define ANCHOR_STEPS 512.0     // of a cell, to a neper
#define ANCHOR_FULL 7130.0     // more a cell does not tell, 13.9 nepers: five cells are 64 bits
#define ANCHOR_LUMPS 1.0       // how much of what is in a cell is taken for lumps; 0: none
#define ANCHOR_NOWHERE 1e6     // the depth of a place where none is kept

#endif
