//! What is known of a block of instructions before it runs: its parts by stage and line of flash, and how it ends.

use anyhow::{Context, Result};

use crate::flash::LINE;
use crate::instruction::{Class, Decoder, Instruction, Jump};
use crate::program::Program;
use crate::stage::{Stage, Stages};
use crate::timing;

/// Instructions one after another in one line of flash and one stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of the line.
    pub line: u32,
    /// `None`: that of the caller.
    pub stage: Option<Stage>,
    /// Instructions.
    pub instructions: u32,
    /// Their cycles without wait states.
    pub cycles: u32,
}

/// An instruction of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Its address.
    pub address: u32,
    /// Which part it belongs to.
    pub part: usize,
    /// Its cycles without wait states.
    pub cycles: u32,
}

/// A block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Its parts; at least one.
    pub parts: Vec<Part>,
    /// Its instructions.
    pub instructions: Vec<Place>,
    /// Address after its last instruction.
    pub end: u32,
    /// How its last instruction jumps, if it can.
    pub jump: Option<Jump>,
    /// Its last instruction is a call.
    pub is_call: bool,
    /// Its first instruction has 32 bits and is not aligned.
    pub begins_unaligned: bool,
    /// It uses the FPU.
    pub floating: bool,
    /// Which function it is in, by its place in the image's list.
    pub function: Option<usize>,
    /// Stages of its divisions, in order.
    pub divisions: Vec<Option<Stage>>,
    /// Words beside the code that it loads: the part that does, and the line of flash.
    pub literals: Vec<(usize, u32)>,
}

impl Block {
    /// Reads a block of the image.
    ///
    /// # Errors
    ///
    /// When there is no code at the address, or the debug information is not sound.
    pub fn read(
        program: &Program<'_>,
        decoder: &Decoder,
        stages: &mut Stages,
        address: u32,
        length: u32,
    ) -> Result<Self> {
        let instructions = decoder.decode(address, program.code(address, length)?)?;
        let last = instructions.last().with_context(|| format!("an empty block at {address:#010x}"))?;
        let mut block = Self {
            parts: Vec::new(),
            instructions: Vec::new(),
            end: address + length,
            jump: last.jump,
            is_call: last.is_call,
            begins_unaligned: instructions[0].length == 4 && !address.is_multiple_of(4),
            floating: instructions.iter().any(|instruction| instruction.floating),
            function: program.image.function_at(address),
            divisions: Vec::new(),
            literals: Vec::new(),
        };
        let mut before: Option<&Instruction> = None;
        for instruction in &instructions {
            let stage = stages.of(&program.functions_at(instruction.address)?);
            let cycles = timing::cycles(before, instruction);
            block.add(instruction, stage, cycles);
            let part = block.parts.len() - 1;
            block.instructions.push(Place { address: instruction.address, part, cycles });
            if instruction.class == Class::Division {
                block.divisions.push(stage);
            }
            if let Some(literal) = instruction.literal {
                block.literals.push((block.parts.len() - 1, literal / LINE));
            }
            before = Some(instruction);
        }
        Ok(block)
    }

    fn add(&mut self, instruction: &Instruction, stage: Option<Stage>, cycles: u32) {
        let first = instruction.address / LINE;
        let last = (instruction.address + instruction.length - 1) / LINE;
        // An instruction that lies in two lines needs both, and belongs to the second one.
        if first != last && self.parts.last().is_none_or(|part| part.line != first) {
            self.parts.push(Part { line: first, stage, instructions: 0, cycles: 0 });
        }
        match self.parts.last_mut() {
            Some(part) if part.line == last && part.stage == stage => {
                part.instructions += 1;
                part.cycles += cycles;
            }
            _ => self.parts.push(Part { line: last, stage, instructions: 1, cycles }),
        }
    }
}
