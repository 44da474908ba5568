//! What both targets do with a file: open it, decode every grid, look at what came out.

use tyndall_vdb::{Value, ValueType, VdbError, VdbFile};

pub(crate) fn read_all(bytes: Vec<u8>) {
    let Ok(file) = VdbFile::from_bytes(bytes) else { return };
    for info in file.grids() {
        let (name, index) = (info.name.as_str(), Some(info.index));
        let result = match info.value_type {
            ValueType::Vec3s => touch::<[f32; 3]>(&file, name, index),
            ValueType::Vec3d => touch::<[f64; 3]>(&file, name, index),
            ValueType::Vec3i => touch::<[i32; 3]>(&file, name, index),
            _ => file.read_grid(name, index).map(|grid| {
                std::hint::black_box((grid.sum(), grid.active_bounds(), grid.value([5, -3, 100])));
            }),
        };
        if let Err(error) = result {
            std::hint::black_box(error.to_string());
        }
    }
}

fn touch<T: Value>(file: &VdbFile, name: &str, index: Option<usize>) -> Result<(), VdbError> {
    let grid = file.read_grid_as::<T>(name, index)?;
    std::hint::black_box((grid.active_voxel_count(), grid.active_bounds(), grid.value([5, -3, 100])));
    Ok(())
}
